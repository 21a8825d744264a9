#include "integrate/methods/explicit_steps.hpp"

#include <algorithm>
#include <cmath>

#include "dynamics/clones.hpp"
#include "integrate/methods/explicit_tables.hpp"

namespace redysim {
namespace {

// Combinations: the rows of the tables without zeros, each with an even number of entries, counted from 1.
// Order: DOP853, then the pairs of order 3 and 5; in each pair the stages, then the error.
constexpr int order_5 = 16, order_3 = 17, first_term = 18, of_dop853 = 24;
constexpr int of_third = of_dop853 + 4, of_fifth = of_third + 7, combinations = of_fifth + 1;
template <int Entries>
struct Sparse {
  double entry[Entries];
  unsigned char slope[Entries];
  unsigned short begin[combinations + 1];
  int rows = 0, count = 0;

  constexpr void add(const double* row, int length) {
    begin[++rows] = static_cast<unsigned short>(count);
    for (int k = 0; k < length; ++k)
      if (row[k] != 0) {
        entry[count] = row[k];
        slope[count++] = static_cast<unsigned char>(k);
      }
    count += count % 2;
    begin[rows + 1] = static_cast<unsigned short>(count);
  }
  constexpr void add_stages(const double* row, int stages) {
    for (int k = 1; k <= stages; row += k++) add(row, k);
  }
  template <int last>
  constexpr void add(const EmbeddedPair<last>& pair) {
    add_stages(pair.rows, last);
    add(pair.error, last + 1);
  }
};
template <int Entries>
constexpr Sparse<Entries> sparse() {
  // The first terms of the polynomial: c = h * result, h f(start) - c, 2 c - h f(start) - h f(end)
  double c_table[3][13] = {};
  const double* result = dop853_rows + 66;  // stage 12
  for (int k = 0; k < 13; ++k) {
    const double c = k < 12 ? result[k] : 0, first = k == 0, end = k == 12;
    c_table[0][k] = c;
    c_table[1][k] = first - c;
    c_table[2][k] = 2 * c - first - end;
  }
  Sparse<Entries> all{};
  all.add_stages(dop853_rows, order_5 - 1);
  for (int k = 0; k < 2; ++k) all.add(dop853_estimates + 12 * k, 12);
  for (const auto& of_term : c_table) all.add(of_term, 13);
  for (int k = 0; k < 4; ++k) all.add(dop853_terms + 16 * k, 16);
  all.add(bogacki_shampine_rows);
  all.add(dormand_prince_rows);
  return all;
}
constexpr Sparse table = sparse<sparse<256>().count>();

// result = base + h * sum of factors[i] * rows[which[i]], with an even number of terms
struct Sum {
  int count;
  const double* factors;
  const unsigned char* which;
  const Lanes<double>* rows;
  std::size_t width;  // lanes per row, even
  double h;
  const Lanes<double>* base;
  Lanes<double>* result;
};

// Computes Count lanes from `at` on; separate sums of even and odd terms hide the latency.
template <int Count>
REDYSIM_INLINE void set_lanes(const Sum& sum, std::size_t at) {
  const char* const rows = reinterpret_cast<const char*>(sum.rows + at);
  const std::size_t bytes = sum.width * sizeof(Lanes<double>);  // size of a row
  const auto row = [&](int i) { return reinterpret_cast<const Lanes<double>*>(rows + sum.which[i] * bytes); };
  Lanes<double> even[Count], odd[Count];
  for (int k = 0; k < Count; ++k) even[k] = odd[k] = Lanes<double>::all(0);
  int i = 0;
  do {
    const Lanes<double>*one = row(i), *other = row(i + 1);
    for (int k = 0; k < Count; ++k) {
      even[k] += sum.factors[i] * one[k];
      odd[k] += sum.factors[i + 1] * other[k];
    }
    i += 2;
  } while (i < sum.count);
  for (int k = 0; k < Count; ++k) sum.result[at + k] = sum.base[at + k] + sum.h * (even[k] + odd[k]);
}

[[gnu::cold, gnu::noinline]] void evaluate_plain(const Sum& sum) {
  for (std::size_t at = 0; at < sum.width; ++at) set_lanes<1>(sum, at);
}

REDYSIM_AVX2 void evaluate_with_avx2(const Sum& sum) {
  std::size_t at = 0;
  for (; at + 4 <= sum.width; at += 4) set_lanes<4>(sum, at);
  if (at < sum.width) set_lanes<2>(sum, at);
}

}  // namespace

const ExplicitTable bogacki_shampine = {3, 3, 2.5, bogacki_shampine_rows.times, of_dop853};
const ExplicitTable dormand_prince = {5, 6, 3.3, dormand_prince_rows.times, of_third};
const ExplicitTable dop853 = {8, 12, 6.3, dop853_times, 0};

[[gnu::cold]] ExplicitSteps::ExplicitSteps(std::size_t size, Slope of_state, void* self)
    : size_(size),
      width_((size + 7) / 8 * 2),
      slope_(of_state),
      self_(self),
      rows_((zero + 1) * width_, Lanes<double>::all(0)) {}

void ExplicitSteps::sum(int count, const double* factors, const unsigned char* which, double h, int base,
                        int result) {
  const Sum sum{count, factors, which, rows_.data(), width_, h, row(base), row(result)};
  if (has_avx2)
    evaluate_with_avx2(sum);
  else
    evaluate_plain(sum);
}

[[gnu::noinline]] void ExplicitSteps::combine(int combination, double h, int base, int result) {
  combination += table_->combinations;
  const int begin = table.begin[combination];
  sum(table.begin[combination + 1] - begin, table.entry + begin, table.slope + begin, h, base, result);
}

bool ExplicitSteps::set_slope(int k, double time, double h) {
  return slope_(time + table_->times[k] * h, numbers(stage), numbers(k), self_);
}

bool ExplicitSteps::step(double time, double h, const double* y, double* end) {
  const int last = table_->last;
  std::copy_n(y, size_, numbers(start));
  for (int k = 1; k < last; ++k) {
    combine(k, h, start, stage);
    if (!set_slope(k, time, h)) return false;
  }
  combine(last, h, start, stage);
  std::copy_n(numbers(stage), size_, end);
  return !ends_with_slope() || set_slope(last, time, h);
}

[[gnu::noinline]] double ExplicitSteps::norm(int combination, const ErrorWeights& error_weights,
                                             const double* weights) {
  combine(combination, 1, zero, start + 1);
  return error_weights.norm(numbers(start + 1), weights);
}

double ExplicitSteps::error(double h, const ErrorWeights& error_weights, const double* weights) {
  if (ends_with_slope()) return h * norm(table_->last + 1, error_weights, weights);
  const double fifth = norm(order_5, error_weights, weights), third = norm(order_3, error_weights, weights);
  const double both = std::hypot(fifth, 0.1 * third);
  return both == 0 ? 0 : h * fifth * (fifth / both);
}

// The polynomial is t0 + x (t1 + r (t2 + x (t3 + r (t4 + ...)))) with x the share and r = 1 - x.
bool ExplicitSteps::fit(double time, double h) {
  if (!set_slope(fitted, time, h)) return false;
  for (int k = fitted + 1; k < stages; ++k) {
    combine(k, h, start, stage);
    if (!set_slope(k, time, h)) return false;
  }
  for (int k = 1; k < terms; ++k) combine(first_term + k - 1, h, zero, start + k);
  return true;
}

void ExplicitSteps::evaluate(double share, double* y) {
  static constexpr unsigned char which[terms] = {start, 17, 18, 19, 20, 21, 22, 23};
  double factors[terms] = {1};
  for (int k = 1; k < terms; ++k) factors[k] = factors[k - 1] * (k % 2 == 1 ? share : 1 - share);
  sum(terms, factors, which, 1, zero, stage);
  std::copy_n(numbers(stage), size_, y);
}

[[gnu::cold]] void ExplicitSteps::save(double* values) const {
  for (int k = fitted; k < stage; k = next_saved(k), values += size_) std::copy_n(numbers(k), size_, values);
}

[[gnu::cold]] void ExplicitSteps::restore(const double* values) {
  for (int k = fitted; k < stage; k = next_saved(k), values += size_) std::copy_n(values, size_, numbers(k));
}

}  // namespace redysim
