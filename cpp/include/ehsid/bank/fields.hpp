// SPDX-License-Identifier: MIT
// Copies one estimator into a lane and out of it: the fields() of a struct of lanes and of the struct of one estimator name
// the same numbers in the same order.
#pragma once

#include <ehsid/bank/lanes.hpp>
#include <ehsid/fields.hpp>

#include <cstring>
#include <vector>

namespace ehsid::bank {
namespace detail {

template <class Type>
inline constexpr bool kIsLanes = false;
template <class Number, int kWidth>
inline constexpr bool kIsLanes<Lanes<Number, kWidth>> = true;

/// visit(number) for each number of a state, or visit(lanes) for those of many.
template <class Owner, class Visit>
void each_value(Owner& owner, const Visit& visit) {
  using Plain = std::remove_const_t<Owner>;
  if constexpr (std::is_arithmetic_v<Plain> || kIsLanes<Plain>) {
    visit(owner);
  } else if constexpr (ehsid::detail::kIsArray<Plain>) {
    for (auto& entry : owner) {
      each_value(entry, visit);
    }
  } else {
    ehsid::detail::each_field<Plain>(
        [&](auto member, auto... /*in_use*/) { each_value(owner.*member, visit); });
  }
}

/// A number as 64 bits.
template <class Number>
std::uint64_t to_bits(Number value) {
  if constexpr (std::is_integral_v<Number>) {
    return static_cast<std::uint64_t>(static_cast<std::int64_t>(value));
  } else {
    return bits_of(value);
  }
}

template <class Number>
Number from_bits(std::uint64_t bits) {
  if constexpr (std::is_integral_v<Number>) {
    return static_cast<Number>(static_cast<std::int64_t>(bits));
  } else {
    const auto narrow = static_cast<typename Bits<Number>::Word>(bits);
    Number value;
    std::memcpy(&value, &narrow, sizeof value);
    return value;
  }
}

}  // namespace detail

/// The numbers of `one` into the lane.
template <class Many, class One>
void set_lane(Many& many, int lane, const One& one) {
  std::vector<std::uint64_t> numbers;
  detail::each_value(one, [&](const auto& value) { numbers.push_back(detail::to_bits(value)); });
  auto next = numbers.begin();
  detail::each_value(many, [&](auto& lanes) {
    using Number = typename std::remove_reference_t<decltype(lanes)>::Number;
    lanes.set(lane, detail::from_bits<Number>(*next++));
  });
}

/// The numbers of the lane into `one`.
template <class Many, class One>
void get_lane(const Many& many, int lane, One& one) {
  std::vector<std::uint64_t> numbers;
  detail::each_value(many,
                     [&](const auto& lanes) { numbers.push_back(detail::to_bits(lanes[lane])); });
  auto next = numbers.begin();
  detail::each_value(one, [&](auto& value) {
    value = detail::from_bits<std::remove_reference_t<decltype(value)>>(*next++);
  });
}

}  // namespace ehsid::bank
