#include "integrate/methods/dop853.hpp"

#include <algorithm>
#include <cmath>

#include "integrate/system/bytes.hpp"

namespace redysim {
namespace {

using namespace sundials;

// clang-format off
constexpr double times[] = {
    0, 0.05260015195876773, 0.0789002279381516, 0.1183503419072274, 0.2816496580927726, 0.3333333333333333,
    0.25, 0.3076923076923077, 0.6512820512820513, 0.6, 0.8571428571428571, 1.0, 1.0, 0.1, 0.2,
    0.7777777777777778};

// Rows 1 to 15 of the stages, row r of r entries. Row 12 is that of the result, the next are those of the
// polynomial.
constexpr double table[] = {
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

// Estimates of order 5 and 3
constexpr double fifth[] = {
    0.01312004499419488, 0, 0, 0, 0, -1.2251564463762044, -0.4957589496572502, 1.6643771824549864,
    -0.35032884874997366, 0.3341791187130175, 0.08192320648511571, -0.022355307863886294};
constexpr double third[] = {
    -0.18980075407240762, 0, 0, 0, 0, 4.450312892752409, 1.8915178993145003, -5.801203960010585,
    -0.4226823213237919, -0.1521609496625161, 0.20136540080403034, 0.02265179219836082};

// Of the terms of the polynomial from the fourth on
constexpr double dense[4][16] = {
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

constexpr int count_nonzero() {
  int count = 0;
  for (const double entry : table) count += entry != 0;
  return count;
}

// The same without zeros; row r from begin[r] on.
struct Rows {
  double entry[count_nonzero()];
  unsigned char slope[sizeof entry / sizeof *entry], begin[Dop853::stages + 1];
};
constexpr Rows without_zeros() {
  Rows rows{};
  int full = 0, count = 0;
  for (int stage = 1; stage < Dop853::stages; ++stage) {
    for (int k = 0; k < stage; ++k, ++full) {
      if (table[full] == 0) continue;
      rows.entry[count] = table[full];
      rows.slope[count++] = static_cast<unsigned char>(k);
    }
    rows.begin[stage + 1] = static_cast<unsigned char>(count);
  }
  return rows;
}
constexpr Rows rows = without_zeros();

}  // namespace

[[gnu::cold]] Dop853::Dop853(long size, SUNContext context, Slope of_state, void* self)
    : size_(static_cast<std::size_t>(size)), slope_(of_state), self_(self) {
  for (Vector& vector : vectors_) vector = make_vector(size, context);
  for (int k = 0; k < vectors; ++k) all_[k] = vectors_[k].get();
}

void Dop853::combine(int stage, double h, N_Vector y, N_Vector result) {
  double factors[stages] = {1};
  N_Vector summands[stages] = {y};
  int count = 1;
  for (int k = rows.begin[stage]; k < rows.begin[stage + 1]; ++k, ++count) {
    factors[count] = h * rows.entry[k];
    summands[count] = all_[rows.slope[k]];
  }
  N_VLinearCombination(count, factors, summands, result);
}

bool Dop853::set_slope(int stage, double time, double h, N_Vector y) {
  return slope_(time + times[stage] * h, data(y), slope(stage), self_);
}

bool Dop853::step(double time, double h, N_Vector y, N_Vector end) {
  for (int stage = 1; stage < last; ++stage) {
    combine(stage, h, y, end);
    if (!set_slope(stage, time, h, end)) return false;
  }
  combine(last, h, y, end);
  return true;
}

double Dop853::error(double h, const ErrorWeights& error_weights, const double* weights) {
  const auto norm = [&](const double* factors) {
    N_VLinearCombination(last, read_only(factors), all_, scratch());
    return error_weights.norm(data(scratch()), weights);
  };
  const double of_fifth = norm(fifth), of_third = norm(third);
  const double both = std::hypot(of_fifth, 0.1 * of_third);
  return both == 0 ? 0 : h * of_fifth * (of_fifth / both);
}

bool Dop853::fit(double time, double h, N_Vector y, N_Vector end) {
  if (!set_slope(last, time, h, end)) return false;
  for (int stage = last + 1; stage < stages; ++stage) {
    combine(stage, h, y, scratch());
    if (!set_slope(stage, time, h, scratch())) return false;
  }
  double factors[stages];
  for (int k = 0; k < 4; ++k) {
    std::transform(dense[k], dense[k] + stages, factors, [h](double entry) { return h * entry; });
    N_VLinearCombination(stages, factors, all_, vectors_[stages + 4 + k].get());
  }
  for (std::size_t i = 0; i < size_; ++i) {
    const double change = data(end)[i] - data(y)[i];
    const double first = h * slope(0)[i], final = h * slope(last)[i];
    term(0)[i] = data(y)[i];
    term(1)[i] = change;
    term(2)[i] = first - change;
    term(3)[i] = 2 * change - (first + final);
  }
  return true;
}

// t0 + x (t1 + r (t2 + x (t3 + r (t4 + ...)))) with the share x and r = 1 - x
void Dop853::evaluate(double share, N_Vector y) {
  double factors[terms] = {1};
  for (int k = 1; k < terms; ++k) factors[k] = factors[k - 1] * (k % 2 == 1 ? share : 1 - share);
  N_VLinearCombination(terms, factors, &all_[stages], y);
}

[[gnu::cold]] void Dop853::put(ByteWriter& writer) const {
  for (int k = last; k < vectors; k = next_saved(k)) writer.put(data(vectors_[k]), size_);
}

[[gnu::cold]] void Dop853::restore(const double* values) {
  for (int k = last; k < vectors; k = next_saved(k), values += size_)
    std::copy_n(values, size_, data(vectors_[k]));
}

}  // namespace redysim
