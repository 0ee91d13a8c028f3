// SPDX-License-Identifier: MIT
// Laws without a name: terms of the plant's equations that a table gives over a variable of its state.
#pragma once

#include <ehsid/plant/dual.hpp>

#include <algorithm>
#include <array>
#include <cstddef>
#include <vector>

namespace ehsid::plant {

/// The equation to which a table adds.
enum class Equation {
  spool,   // opening of the valve, fraction of rated command
  flow_a,  // flow into chamber A, m^3/s
  flow_b,  // flow into chamber B, m^3/s
  force,   // force against extension, N
  sensor,  // reading of the position, m
  delay,   // delay of the command path, s
  mass,    // what moves with the rod, kg; over the position only
  count
};

/// The variable over which a table is given.
enum class Variable {
  velocity,
  position,
  spool,
  pressure_a,
  pressure_b,
  supply_pressure,
  time,
  count
};

/// Names in the order of Equation and of Variable.
inline constexpr std::array kEquationNames{"spool",  "flow_a", "flow_b", "force",
                                           "sensor", "delay",  "mass"};
inline constexpr std::array kVariableNames{"velocity_m_s",  "position_m",    "spool",
                                           "pressure_a_pa", "pressure_b_pa", "supply_pressure_pa",
                                           "time_s"};
static_assert(kEquationNames.size() == static_cast<std::size_t>(Equation::count));
static_assert(kVariableNames.size() == static_cast<std::size_t>(Variable::count));

/// A table but for its values: at least two knots, rising, in the unit of the variable. Between two knots the term is
/// linear, beyond the outer ones constant.
struct TableShape {
  Equation adds_to = Equation::force;
  Variable of = Variable::position;
  std::vector<double> knots;
};

/// Number of values of all tables together.
inline std::size_t table_values(const std::vector<TableShape>& shapes) {
  std::size_t count = 0;
  for (const TableShape& shape : shapes) {
    count += shape.knots.size();
  }
  return count;
}

/// The variables now, in the order of Variable.
template <class Scalar>
using Variables = std::array<Scalar, static_cast<std::size_t>(Variable::count)>;

/// A term at a point: its value, and its slope by its own variable.
template <class Scalar>
struct Term {
  Scalar value{};
  Scalar slope{};
};

/// All tables of a plant.
template <class Scalar>
class Tables {
 public:
  Tables() = default;

  /// values: those of the tables one after the other begin at `first`.
  Tables(const std::vector<TableShape>& shapes, const std::vector<Scalar>& values,
         std::size_t first) {
    for (const TableShape& shape : shapes) {
      const auto begin = values.begin() + static_cast<std::ptrdiff_t>(first);
      const auto count = static_cast<std::ptrdiff_t>(shape.knots.size());
      tables_.push_back({shape, {begin, begin + count}});
      first += shape.knots.size();
      acts_[static_cast<std::size_t>(shape.adds_to)] = true;
    }
  }

  /// Whether any table adds to this equation.
  bool act_on(Equation equation) const { return acts_[static_cast<std::size_t>(equation)]; }

  /// Sum of the tables that add to an equation. `along`: the variable by which the slope is wanted; tables of other
  /// variables do not count in it.
  Term<Scalar> at(Equation equation, const Variables<Scalar>& now,
                  Variable along = Variable::count) const {
    Term<Scalar> sum{};
    for (const Table& table : tables_) {
      if (table.shape.adds_to == equation) {
        const Term<Scalar> term = table.at(now[static_cast<std::size_t>(table.shape.of)]);
        sum.value += term.value;
        if (table.shape.of == along) {
          sum.slope += term.slope;
        }
      }
    }
    return sum;
  }

 private:
  struct Table {
    TableShape shape;
    std::vector<Scalar> values;

    Term<Scalar> at(const Scalar& x) const {
      const std::vector<double>& knots = shape.knots;
      if (!(value_of(x) > knots.front())) {
        return {values.front(), Scalar(0.0)};
      }
      if (!(value_of(x) < knots.back())) {
        return {values.back(), Scalar(0.0)};
      }
      const auto next = std::upper_bound(knots.begin(), knots.end(), value_of(x));
      const auto i = static_cast<std::size_t>(next - knots.begin());
      const Scalar slope = (values[i] - values[i - 1]) * (1.0 / (knots[i] - knots[i - 1]));
      return {values[i - 1] + slope * (x - knots[i - 1]), slope};
    }
  };

  std::vector<Table> tables_;
  std::array<bool, static_cast<std::size_t>(Equation::count)> acts_{};
};

}  // namespace ehsid::plant
