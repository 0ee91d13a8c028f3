// SPDX-License-Identifier: MIT
// Forgetting policies across lanes: their own text, see forgetting/select.hpp, with a register of numbers in place of one.
// Each lane has settings and state of its own.
#pragma once

#include <ehsid/bank/fields.hpp>
#include <ehsid/bank/sliding_sums.hpp>
#include <ehsid/forgetting.hpp>

namespace ehsid {

template <class Number, int kWidth>
struct SelectForm<bank::Lanes<Number, kWidth>> {
  using Scalar = Number;
  using Truth = typename bank::Lanes<Number, kWidth>::Truth;
  using Count = bank::Lanes<Number, kWidth>;  // a float holds 2^20 exactly
  template <int kWindow>
  using Sum = bank::SlidingSums<bank::Lanes<Number, kWidth>, kWindow>;
};

namespace bank {

/// The policy `Policy` of as many estimators as `V` has lanes.
template <class Policy, class V>
using PolicyOver = typename Policy::template Over<V>;

namespace detail {

// A member of many policies, from and to the same member of one. That two are not the same shows in their types only, so
// the others are compiled, too, and do nothing.
template <class Many, class One>
void put_into(Many& many, int lane, const One& one) {
  if constexpr (kIsLanes<Many> && std::is_arithmetic_v<One>) {
    many.set(lane, static_cast<typename Many::Number>(one));
  } else if constexpr (!kIsLanes<Many> && !std::is_arithmetic_v<One>) {
    if constexpr (std::is_same_v<typename Many::One, One>) {
      many.set(lane, one);
    }
  }
}
template <class Many, class One>
void take_out(const Many& many, int lane, One& one) {
  if constexpr (kIsLanes<Many> && std::is_arithmetic_v<One>) {
    one = static_cast<One>(many[lane]);
  } else if constexpr (!kIsLanes<Many> && !std::is_arithmetic_v<One>) {
    if constexpr (std::is_same_v<typename Many::One, One>) {
      many.get(lane, one);
    }
  }
}

/// visit(member of many, the same member of one) for each setting, and for each member of the state.
template <class Many, class One, class Visit>
void each_member(Many& many, One& one, const Visit& visit) {
  using PolicyOfMany = std::remove_const_t<Many>;
  using PolicyOfOne = std::remove_const_t<One>;
  PolicyOfOne::settings(
      [&](const SettingInfo& /*setting*/, auto member) { visit(member(many), member(one)); });
  // Both list the same members in the same order, but pointers to them have different types.
  std::size_t place = 0;
  ehsid::detail::each_field<PolicyOfOne>([&](auto of_one) {
    std::size_t at = 0;
    ehsid::detail::each_field<PolicyOfMany>([&](auto of_many) {
      if (at == place) {
        visit(many.*of_many, one.*of_one);
      }
      ++at;
    });
    ++place;
  });
}

}  // namespace detail

/// Settings and state of one policy into a lane.
template <class Many, class One>
void set_policy(Many& many, int lane, const One& one) {
  detail::each_member(
      many, one, [&](auto& lanes, const auto& number) { detail::put_into(lanes, lane, number); });
}

/// Settings and state of a lane into one policy.
template <class Many, class One>
void get_policy(const Many& many, int lane, One& one) {
  detail::each_member(
      many, one, [&](const auto& lanes, auto& number) { detail::take_out(lanes, lane, number); });
}

}  // namespace bank
}  // namespace ehsid
