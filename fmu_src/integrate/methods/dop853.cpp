#include "integrate/methods/dop853.hpp"

#include <algorithm>
#include <cmath>

#include "dynamics/clones.hpp"

namespace redysim {
namespace {

// clang-format off
constexpr double times[] = {
    0, 0.05260015195876773, 0.0789002279381516, 0.1183503419072274, 0.2816496580927726, 0.3333333333333333,
    0.25, 0.3076923076923077, 0.6512820512820513, 0.6, 0.8571428571428571, 1.0, 1.0, 0.1, 0.2,
    0.7777777777777778};

// Of the slopes: stages 1 to 15, stage r of r entries. Stage 12 is the result, the next are those of the
// polynomial.
constexpr double stage_table[] = {
    0.05260015195876773,
    0.0197250569845379, 0.0591751709536137,
    0.02958758547680685, 0, 0.08876275643042054,
    0.2413651341592667, 0, -0.8845494793282861, 0.924834003261792,
    0.037037037037037035, 0, 0, 0.17082860872947386, 0.12546768756682242,
    0.037109375, 0, 0, 0.17025221101954405, 0.06021653898045596, -0.017578125,
    0.03709200011850479, 0, 0, 0.17038392571223998, 0.10726203044637328, -0.015319437748624402,
    0.008273789163814023,
    0.6241109587160757, 0, 0, -3.3608926294469414, -0.868219346841726, 27.59209969944671,
    20.154067550477894, -43.48988418106996,
    0.47766253643826434, 0, 0, -2.4881146199716677, -0.590290826836843, 21.230051448181193,
    15.279233632882423, -33.28821096898486, -0.020331201708508627,
    -0.9371424300859873, 0, 0, 5.186372428844064, 1.0914373489967295, -8.149787010746927,
    -18.52006565999696, 22.739487099350505, 2.4936055526796523, -3.0467644718982196,
    2.273310147516538, 0, 0, -10.53449546673725, -2.0008720582248625, -17.9589318631188, 27.94888452941996,
    -2.8589982771350235, -8.87285693353063, 12.360567175794303, 0.6433927460157636,
    0.054293734116568765, 0, 0, 0, 0, 4.450312892752409, 1.8915178993145003, -5.801203960010585,
    0.3111643669578199, -0.1521609496625161, 0.20136540080403034, 0.04471061572777259,
    0.056167502283047954, 0, 0, 0, 0, 0, 0.25350021021662483, -0.2462390374708025, -0.12419142326381637,
    0.15329179827876568, 0.00820105229563469, 0.007567897660545699, -0.008298,
    0.03183464816350214, 0, 0, 0, 0, 0.028300909672366776, 0.053541988307438566, -0.05492374857139099, 0,
    0, -0.00010834732869724932, 0.0003825710908356584, -0.00034046500868740456, 0.1413124436746325,
    -0.42889630158379194, 0, 0, 0, 0, -4.697621415361164, 7.683421196062599, 4.06898981839711,
    0.3567271874552811, 0, 0, 0, -0.0013990241651590145, 2.9475147891527724, -9.15095847217987};

// Error estimates of order 5 and 3, 12 entries each
constexpr double estimate_table[] = {
    0.01312004499419488, 0, 0, 0, 0, -1.2251564463762044, -0.4957589496572502, 1.6643771824549864,
    -0.35032884874997366, 0.3341791187130175, 0.08192320648511571, -0.022355307863886294,
    -0.18980075407240762, 0, 0, 0, 0, 4.450312892752409, 1.8915178993145003, -5.801203960010585,
    -0.4226823213237919, -0.1521609496625161, 0.20136540080403034, 0.02265179219836082};

// Terms of the polynomial from the fourth on, 16 entries each
constexpr double term_table[] = {
    -8.428938276109013, 0, 0, 0, 0, 0.5667149535193777, -3.0689499459498917, 2.38466765651207,
    2.117034582445028, -0.871391583777973, 2.2404374302607883, 0.6315787787694688, -0.08899033645133331,
    18.148505520854727, -9.194632392478356, -4.436036387594894,
    10.427508642579134, 0, 0, 0, 0, 242.28349177525817, 165.20045171727028, -374.5467547226902,
    -22.113666853125306, 7.733432668472264, -30.674084731089398, -9.332130526430229, 15.697238121770845,
    -31.139403219565178, -9.35292435884448, 35.81684148639408,
    19.985053242002433, 0, 0, 0, 0, -387.0373087493518, -189.17813819516758, 527.8081592054236,
    -11.57390253995963, 6.8812326946963, -1.0006050966910838, 0.7777137798053443, -2.778205752353508,
    -60.19669523126412, 84.32040550667716, 11.99229113618279,
    -25.69393346270375, 0, 0, 0, 0, -154.18974869023643, -231.5293791760455, 357.6391179106141,
    93.40532418362432, -37.45832313645163, 104.0996495089623, 29.8402934266605, -43.53345659001114,
    96.32455395918828, -39.17726167561544, -149.72683625798564,};
// clang-format on

// The rows of the tables without zeros, each with an even number of entries.
constexpr int order_5 = 16, order_3 = 17, first_term = 18, combinations = 25;  // the rest: stages
template <int Entries>
struct Sparse {
  double entry[Entries];
  unsigned char slope[Entries], begin[combinations + 1];

  constexpr int add(int count, const double* row, int length) {
    for (int k = 0; k < length; ++k)
      if (row[k] != 0) {
        entry[count] = row[k];
        slope[count++] = static_cast<unsigned char>(k);
      }
    return count + count % 2;
  }
};
template <int Entries>
constexpr Sparse<Entries> sparse() {
  // The first terms of the polynomial: c = h * result, h f(start) - c, 2 c - h f(start) - h f(end)
  double c_table[3][13] = {};
  const double* result = stage_table + 66;  // stage 12
  for (int k = 0; k < 13; ++k) {
    const double c = k < 12 ? result[k] : 0, first = k == 0, end = k == 12;
    c_table[0][k] = c;
    c_table[1][k] = first - c;
    c_table[2][k] = 2 * c - first - end;
  }
  Sparse<Entries> all{};
  int count = 0, row = 1;
  const auto add = [&](const double* from, int length) {
    all.begin[row++] = static_cast<unsigned char>(count);
    count = all.add(count, from, length);
  };
  for (const double* from = stage_table; row < order_5; from += row - 1) add(from, row);
  for (int k = 0; k < 2; ++k) add(estimate_table + 12 * k, 12);
  for (const auto& of_term : c_table) add(of_term, 13);
  for (int k = 0; k < 4; ++k) add(term_table + 16 * k, 16);
  all.begin[row] = static_cast<unsigned char>(count);
  return all;
}
constexpr Sparse table = sparse<sparse<256>().begin[combinations]>();

// result = base + h * sum of factors * rows, with an even number of terms
struct Sum {
  int count;
  const double* factors;
  const unsigned char* which;
  const Lanes<double>* rows;
  std::size_t width;
  double h;
  const Lanes<double>* base;
  Lanes<double>* result;
};

// The lanes from `at` on; even and odd terms hide each other's latency.
template <int Count>
REDYSIM_INLINE void set_lanes(const Sum& sum, std::size_t at) {
  Lanes<double> even[Count], odd[Count];
  for (int k = 0; k < Count; ++k) even[k] = odd[k] = Lanes<double>::all(0);
  for (int i = 0; i < sum.count; i += 2) {
    const Lanes<double>* one = sum.rows + sum.which[i] * sum.width + at;
    const Lanes<double>* other = sum.rows + sum.which[i + 1] * sum.width + at;
    for (int k = 0; k < Count; ++k) {
      even[k] += sum.factors[i] * one[k];
      odd[k] += sum.factors[i + 1] * other[k];
    }
  }
  for (int k = 0; k < Count; ++k) sum.result[at + k] = sum.base[at + k] + sum.h * (even[k] + odd[k]);
}

[[gnu::cold, gnu::noinline]] void evaluate_plain(const Sum& sum) {
  for (std::size_t at = 0; at < sum.width; ++at) set_lanes<1>(sum, at);
}

REDYSIM_AVX2 void evaluate_with_avx2(const Sum& sum) {
  std::size_t at = 0;
  for (; at + 3 <= sum.width; at += 3) set_lanes<3>(sum, at);
  for (; at < sum.width; ++at) set_lanes<1>(sum, at);
}

}  // namespace

[[gnu::cold]] Dop853::Dop853(std::size_t size, Slope of_state, void* self)
    : size_(size),
      width_((size + 3) / 4),
      slope_(of_state),
      self_(self),
      rows_((zero + 1) * width_, Lanes<double>::all(0)) {}

void Dop853::sum(int count, const double* factors, const unsigned char* which, double h, int base,
                 int result) {
  const Sum sum{count, factors, which, rows_.data(), width_, h, row(base), row(result)};
  if (has_avx2)
    evaluate_with_avx2(sum);
  else
    evaluate_plain(sum);
}

[[gnu::noinline]] void Dop853::combine(int combination, double h, int base, int result) {
  const int begin = table.begin[combination];
  sum(table.begin[combination + 1] - begin, table.entry + begin, table.slope + begin, h, base, result);
}

bool Dop853::set_slope(int k, double time, double h) {
  return slope_(time + times[k] * h, numbers(stage), numbers(k), self_);
}

bool Dop853::step(double time, double h, const double* y, double* end) {
  std::copy_n(y, size_, numbers(start));
  for (int k = 1; k < last; ++k) {
    combine(k, h, start, stage);
    if (!set_slope(k, time, h)) return false;
  }
  combine(last, h, start, stage);
  std::copy_n(numbers(stage), size_, end);
  return true;
}

[[gnu::noinline]] double Dop853::norm(int combination, const ErrorWeights& error_weights,
                                      const double* weights) {
  combine(combination, 1, zero, start + 1);
  return error_weights.norm(numbers(start + 1), weights);
}

double Dop853::error(double h, const ErrorWeights& error_weights, const double* weights) {
  const double fifth = norm(order_5, error_weights, weights), third = norm(order_3, error_weights, weights);
  const double both = std::hypot(fifth, 0.1 * third);
  return both == 0 ? 0 : h * fifth * (fifth / both);
}

// The polynomial is t0 + x (t1 + r (t2 + x (t3 + r (t4 + ...)))) with the share x and r = 1 - x.
bool Dop853::fit(double time, double h) {
  if (!set_slope(last, time, h)) return false;
  for (int k = last + 1; k < stages; ++k) {
    combine(k, h, start, stage);
    if (!set_slope(k, time, h)) return false;
  }
  for (int k = 1; k < terms; ++k) combine(first_term + k - 1, h, zero, start + k);
  return true;
}

void Dop853::evaluate(double share, double* y) {
  static constexpr unsigned char which[terms] = {start, 17, 18, 19, 20, 21, 22, 23};
  double factors[terms] = {1};
  for (int k = 1; k < terms; ++k) factors[k] = factors[k - 1] * (k % 2 == 1 ? share : 1 - share);
  sum(terms, factors, which, 1, zero, stage);
  std::copy_n(numbers(stage), size_, y);
}

[[gnu::cold]] void Dop853::save(double* values) const {
  for (int k = last; k < stage; k = next_saved(k), values += size_) std::copy_n(numbers(k), size_, values);
}

[[gnu::cold]] void Dop853::restore(const double* values) {
  for (int k = last; k < stage; k = next_saved(k), values += size_) std::copy_n(values, size_, numbers(k));
}

}  // namespace redysim
