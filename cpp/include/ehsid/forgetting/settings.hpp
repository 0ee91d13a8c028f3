// SPDX-License-Identifier: MIT
// How a forgetting policy describes itself and its settings. The Python module, the C interface, the exporters, the
// HIL protocol, the command line and the documents take names, ranges and meanings from these descriptions. They are
// compile-time constants: firmware that does not print them does not contain them.
#pragma once

#include <ehsid/types.hpp>

#include <type_traits>

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
inline constexpr int kHilPlaces = 10;

/// A setting in words. Its default stands at the member of the policy.
struct SettingInfo {
  const char* name;  // of the member, in the policy and in ehsid_forgetting of c_api.h
  Range range;
  const char* unit;  // "1" for a pure number
  const char* meaning;
  int hil_place;  // which of the kHilPlaces numbers carries it; policies share them
};

/// Has this member of a policy a number for each parameter, and not one for all?
template <class Member>
inline constexpr bool kPerParameter =
    !std::is_arithmetic<typename std::remove_reference<Member>::type>::value;

/// Calls visit(number) for a setting, or for each number of a setting that has one for each parameter.
template <class Member, class Visit>
EHSID_ALWAYS_INLINE inline void each_number(Member& setting, Visit visit) {
  if constexpr (kPerParameter<Member>) {
    for (auto& number : setting) {
      visit(number);
    }
  } else {
    visit(setting);
  }
}

/// Is every setting of the policy in its range?
template <class Policy>
EHSID_ALWAYS_INLINE inline bool settings_valid(const Policy& policy) {
  bool good = true;
  Policy::settings([&](const SettingInfo& setting, auto member) {
    each_number(member(policy),
                [&](const auto& number) { good = setting.range.contains(number) && good; });
  });
  return good;
}

}  // namespace ehsid
