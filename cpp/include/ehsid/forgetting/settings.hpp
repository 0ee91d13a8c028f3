// SPDX-License-Identifier: MIT
// How a forgetting policy describes itself and its settings. The Python module, the C interface, the exporters, the
// HIL protocol, the command line and the documents take names, ranges and meanings from these descriptions. They are
// compile-time constants: firmware that does not print them does not contain them.
#pragma once

#include <ehsid/types.hpp>

#include <type_traits>
#include <utility>

namespace ehsid {

/// A forgetting policy in words.
struct PolicyInfo {
  const char* id;    // snake_case: its name in C, in files and, with hyphens, on the command line
  const char* type;  // the same in PascalCase: its class template in C++, its class in Python
  const char* summary;  // one line
  const char* source;   // author and year; the complete reference stands above the class
};

/// The finite values that a setting may have.
struct Range {
  double minimum;
  bool open;  // the minimum itself does not belong to the range
  bool bounded;
  double maximum;  // belongs to the range; not used unless bounded

  static constexpr Range factor() { return {0.0, true, true, 1.0}; }  // (0, 1]
  static constexpr Range at_least(double value) { return {value, false, false, 0.0}; }
  static constexpr Range above(double value) { return {value, true, false, 0.0}; }

  template <class Scalar>
  EHSID_ALWAYS_INLINE bool contains(Scalar value) const {
    const auto least = static_cast<Scalar>(minimum);
    const bool below = bounded ? value <= static_cast<Scalar>(maximum) : is_finite(value);
    return below && (open ? value > least : value >= least);
  }
};

/// The numbers of `configure` (docs/hil_protocol.md) that carry the settings of the policy.
inline constexpr int kHilPlaces = 8;

/// A setting in words. Its default stands at the member of the policy.
struct SettingInfo {
  const char* name;  // of the member, in the policy and in ehsid_forgetting of c_api.h
  Range range;
  const char* unit;  // "1" for a pure number
  const char* meaning;
  int hil_place;  // which of the kHilPlaces numbers carries it; policies share them
};

namespace detail {

template <class Policy, class Scalar, class = void>
struct PolicyOf {
  static constexpr bool kPolicy = false;
  static constexpr bool kSameNumber = true;
};

template <class Policy, class Scalar>
struct PolicyOf<Policy, Scalar,
                std::void_t<decltype(Policy::kId), decltype(Policy::kInfo),
                            decltype(std::declval<const Policy&>().loss()),
                            typename Policy::template Over<Scalar>>> {
  static constexpr bool kPolicy = true;
  static constexpr bool kSameNumber =
      std::is_same<typename Policy::template Over<Scalar>, Policy>::value;
};

}  // namespace detail

/// Is every setting of the policy in its range?
template <class Policy>
EHSID_ALWAYS_INLINE inline bool settings_valid(const Policy& policy) {
  bool good = true;
  Policy::settings([&](const SettingInfo& setting, auto member) {
    good = setting.range.contains(member(policy)) && good;
  });
  return good;
}

}  // namespace ehsid
