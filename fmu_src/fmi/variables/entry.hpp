#pragma once

#include <array>
#include <iterator>
#include <type_traits>
#include <utility>

#include "fmi/variables/dependencies.hpp"
#include "fmi/variables/groups.hpp"
#include "fmi/variables/presentation.hpp"
#include "fmi/variables/row.hpp"

// Definition of one role of variables: an Entry contains the Row of the running FMU and the Words of the XML.
// Entries exist at compile time only. `rows_in` and `words_in` split them, so the library in an FMU, which
// does not refer to the words, contains none of them.

namespace redysim {

struct Entry {
  Row row;
  Words words;

  // null: always exists, is not computed, is not a parameter, ...; a null derivative is 0
  bool (*condition)(const Scene&, const Variable&) = nullptr;
  double (*value)(Values&, const Variable&) = nullptr;
  double& (*place)(Parameters<double>&, const Variable&) = nullptr;
  Dual& (*dual_place)(Parameters<Dual>&, const Variable&) = nullptr;
  int (*index)(const System&, const Variable&) = nullptr;
  double (*rate_of_change)(OutputDerivatives&, const Variable&) = nullptr;

  // --- the running FMU ---

  constexpr Entry of(Owner owner) const {  // the same entry for another kind of owner
    Entry e = *this;
    e.row.owner = owner;
    return e;
  }
  constexpr Entry array(int rows, int columns = 0) const {
    Entry e = *this;
    e.row.rows = static_cast<std::uint8_t>(rows);
    e.row.columns = static_cast<std::uint8_t>(columns);
    return e;
  }
  constexpr Entry bounds(Bounds bounds, int elements = 255) const {  // for the first elements
    Entry e = *this;
    e.row.bounds = bounds;
    e.row.bounded = static_cast<std::uint8_t>(elements);
    return e;
  }
  constexpr Entry discrete(VariableType type = VariableType::real) const {
    Entry e = *this;
    e.row.variability = Variability::discrete;
    e.row.type = type;
    return e;
  }
  constexpr Entry fixed(VariableType type = VariableType::real) const {
    Entry e = *this;
    e.row.variability = Variability::fixed;
    e.row.type = type;
    return e;
  }
  constexpr Entry integer() const {
    Entry e = *this;
    e.row.type = VariableType::integer;
    return e;
  }
  constexpr Entry adds_to_controller() const {
    Entry e = *this;
    e.row.adds_to_controller = true;
    return e;
  }
  // exists if the model file requests the group ...
  constexpr Entry in(OutputGroup group) const {
    Entry e = *this;
    e.row.in_group = true;
    e.row.group = group;
    return e;
  }
  // Makes a local variable for model exchange: a state or a derivative. After in(): it exists if the output
  // does not.
  constexpr Entry local() const {
    Entry e = *this;
    e.row.causality = Causality::local;
    return e;
  }
  constexpr Entry is_state(StatePart part) const {
    Entry e = *this;
    e.row.state = part;
    return e;
  }
  constexpr Entry slope_of(StatePart part) const {
    Entry e = *this;
    e.row.slope_of = part;
    return e;
  }
  // ... and if this condition holds
  constexpr Entry there_if(bool (*holds)(const Scene&, const Variable&)) const {
    Entry e = *this;
    e.condition = holds;
    return e;
  }
  constexpr Entry reads(double (*read)(Values&, const Variable&), Needs needs = Needs::nothing) const {
    Entry e = *this;
    e.value = read;
    e.row.needs = needs;
    return e;
  }
  // `member` returns the member of Parameters<Scalar>. Derivatives by it exist if it also accepts dual
  // numbers.
  template <class Member>
  constexpr Entry sets(Member member) const {
    Entry e = *this;
    e.place = member;
    e.row.storage = Storage::parameter;
    if constexpr (std::is_convertible_v<Member, decltype(dual_place)>) {
      e.dual_place = member;
      e.row.has_direction = true;
    }
    return e;
  }
  constexpr Entry input_at(int (*at)(const System&, const Variable&)) const {
    Entry e = acts_on(acts::force);
    e.index = at;
    e.row.storage = Storage::input;
    e.row.has_direction = true;
    return e;
  }
  constexpr Entry motion(int order) const {
    Entry e = *this;
    e.row.storage = Storage::motion;
    e.row.motion_order = static_cast<std::uint8_t>(order);
    e.row.has_direction = true;
    return e;
  }
  constexpr Entry acts_on(unsigned what) const {
    Entry e = *this;
    e.row.acts = static_cast<std::uint16_t>(what);
    return e;
  }
  constexpr Entry derivative(double (*read)(OutputDerivatives&, const Variable&)) const {
    Entry e = *this;
    e.rate_of_change = read;
    return e;
  }
  constexpr Entry event_indicator() const {
    Entry e = *this;
    e.row.is_indicator = true;
    return e;
  }
  constexpr Entry rate_is_next() const {
    Entry e = *this;
    e.row.rate_is_next = true;
    return e;
  }

  // --- the description ---

  constexpr Entry measures(const Quantity& turning, const Quantity& sliding) const {
    Entry e = *this;
    e.words.turning = turning;
    e.words.sliding = sliding;
    return e;
  }
  constexpr Entry measures(const Quantity& quantity) const { return measures(quantity, quantity); }
  constexpr Entry says(const char* turning, const char* sliding) const {
    Entry e = *this;
    e.words.turning_text = turning;
    e.words.sliding_text = sliding;
    return e;
  }
  constexpr Entry says(const char* text) const { return says(text, text); }
  template <std::size_t count>
  constexpr Entry labels(const char* const (&labels)[count]) const {
    Entry e = *this;
    e.words.labels = labels;
    e.words.label_count = static_cast<int>(count);
    return e;
  }
  constexpr Entry adapted(void (*adapt)(const Model&, const Variable&, Presentation&)) const {
    Entry e = *this;
    e.words.adapt = adapt;
    return e;
  }
  constexpr Entry starts_at(double (*start)(const Model&, const Variable&)) const {
    Entry e = *this;
    e.words.start = start;
    return e;
  }
  constexpr Entry depends(Rule at_point, Rule at_start) const {
    Entry e = *this;
    e.words.at_point = at_point;
    e.words.at_start = at_start;
    return e;
  }
  constexpr Entry constant(ConstantFactor constant) const {
    Entry e = *this;
    e.words.constant = constant;
    return e;
  }
};

constexpr Entry output(Owner owner, const char* name) {
  Entry e;
  e.row.owner = owner;
  e.row.name = name;
  return e;
}

constexpr Entry input(Owner owner, const char* name) {
  Entry e = output(owner, name);
  e.row.causality = Causality::input;
  return e;
}

// Exists if the model file lists it as tunable; fixed() parameters always exist.
constexpr Entry parameter(Owner owner, const char* name) {
  Entry e = output(owner, name);
  e.row.causality = Causality::parameter;
  e.row.variability = Variability::tunable;
  return e;
}

template <const auto& entries, class Item, Item Entry::*part>
struct Column {
  static constexpr std::size_t count = std::size(entries);
  static constexpr std::array<Item, count> made() {
    std::array<Item, count> column{};
    for (std::size_t i = 0; i < count; ++i) column[i] = entries[i].*part;
    return column;
  }
  static constexpr std::array<Item, count> items = made();
};

// Whether a function pointer is not null, by comparison of types: with gcc's checks for undefined behaviour,
// the comparison with null is not a constant.
template <auto function>
inline constexpr bool is_set = !std::is_same_v<std::integral_constant<decltype(function), function>,
                                               std::integral_constant<decltype(function), nullptr>>;

// The functions of all entries of a group, selected by row index. A call is a chain of comparisons with
// constants, since tables of function pointers would need relocation when the library is loaded.
template <const auto& entries>
struct Functions {
  template <auto function, std::size_t i = 0, class Result, class... Arguments>
  static Result call(int row, Result otherwise, Arguments&... arguments) {
    if constexpr (i < std::size(entries)) {
      constexpr auto called = entries[i].*function;
      if (row != static_cast<int>(i)) return call<function, i + 1>(row, otherwise, arguments...);
      if constexpr (is_set<called>) {
        using Returned = decltype(called(arguments...));
        if constexpr (std::is_void_v<Returned>)
          called(arguments...);
        else if constexpr (std::is_reference_v<Returned>)
          return &called(arguments...);
        else
          return called(arguments...);
      }
    }
    return otherwise;
  }

  static bool exists(int row, const Scene& scene, const Variable& variable) {
    return call<&Entry::condition>(row, true, scene, variable);
  }
  static double read(int row, Values& values, const Variable& variable) {
    return call<&Entry::value>(row, 0.0, values, variable);
  }
  static double* place(int row, Parameters<double>& parameters, const Variable& variable) {
    return call<&Entry::place>(row, static_cast<double*>(nullptr), parameters, variable);
  }
  static Dual* dual_place(int row, Parameters<Dual>& parameters, const Variable& variable) {
    return call<&Entry::dual_place>(row, static_cast<Dual*>(nullptr), parameters, variable);
  }
  static int input(int row, const System& system, const Variable& variable) {
    return call<&Entry::index>(row, 0, system, variable);
  }
  static double derivative(int row, OutputDerivatives& derivatives, const Variable& variable) {
    return call<&Entry::rate_of_change>(row, 0.0, derivatives, variable);
  }
};

template <const auto& entries, auto function, std::size_t... i>
constexpr bool any_of(std::index_sequence<i...>) {
  return (is_set<entries[i].*function> || ...);
}
template <const auto& entries, auto function>
inline constexpr bool any_has = any_of<entries, function>(std::make_index_sequence<std::size(entries)>());

template <const auto& entries>
inline constexpr RowGroup rows_in{
    Column<entries, Row, &Entry::row>::items.data(),
    static_cast<int>(std::size(entries)),
    any_has<entries, &Entry::condition> ? Functions<entries>::exists : nullptr,
    any_has<entries, &Entry::value> ? Functions<entries>::read : nullptr,
    any_has<entries, &Entry::place> ? Functions<entries>::place : nullptr,
    any_has<entries, &Entry::dual_place> ? Functions<entries>::dual_place : nullptr,
    any_has<entries, &Entry::index> ? Functions<entries>::input : nullptr,
    any_has<entries, &Entry::rate_of_change> ? Functions<entries>::derivative : nullptr};

template <const auto& entries>
inline constexpr WordGroup words_in{Column<entries, Words, &Entry::words>::items.data(),
                                    static_cast<int>(std::size(entries))};

}  // namespace redysim
