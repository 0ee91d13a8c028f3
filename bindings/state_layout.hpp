// SPDX-License-Identifier: MIT
// The state of an estimator whose size was chosen at run time, as the bytes of the same estimator with a static size:
// those that C and C++ save (docs/linking.md). A test compares them.
#pragma once

#include <ehsid/forgetting.hpp>

#include <algorithm>
#include <cstddef>
#include <string>
#include <type_traits>
#include <utility>

namespace ehsid::bindings {

/// Appends numbers where a C++ struct has them; the bytes between them are zero.
class StateWriter {
 public:
  void align(std::size_t alignment) {
    bytes_.resize((bytes_.size() + alignment - 1) / alignment * alignment, '\0');
  }
  template <class Plain>
  void values(const Plain* from, std::size_t count) {
    align(alignof(Plain));
    bytes_.append(reinterpret_cast<const char*>(from), count * sizeof(Plain));
  }
  const std::string& bytes() const { return bytes_; }

 private:
  std::string bytes_;
};

/// Reads what a StateWriter wrote. The caller has compared the number of bytes.
class StateReader {
 public:
  explicit StateReader(const std::string& bytes) : bytes_(bytes) {}
  void align(std::size_t alignment) { at_ = (at_ + alignment - 1) / alignment * alignment; }
  template <class Plain>
  void values(Plain* to, std::size_t count) {
    align(alignof(Plain));
    bytes_.copy(reinterpret_cast<char*>(to), count * sizeof(Plain), at_);
    at_ += count * sizeof(Plain);
  }

 private:
  const std::string& bytes_;
  std::size_t at_ = 0;
};

/// One value after the other.
template <class Stream, class... Plain>
void lay_out_each(Stream& stream, Plain&... values) {
  (stream.values(&values, 1), ...);
}

template <class Policy>
constexpr std::size_t settings_bytes() {
  std::size_t bytes = 0;
  Policy::settings([&](const SettingInfo& /*setting*/, auto member) {
    bytes += sizeof(std::remove_reference_t<decltype(member(std::declval<Policy&>()))>);
  });
  return bytes;
}

template <class Stream, class Number>
void lay_out_setting(Stream& stream, Number& setting, std::size_t n) {
  if constexpr (kPerParameter<Number>) {
    stream.values(setting.data(), n);
  } else {
    stream.values(&setting, 1);
  }
}

/// A policy of n parameters.
template <class Stream, class Policy>
void lay_out_policy(Stream& stream, Policy& policy, std::size_t n) {
  if constexpr (takes_size(std::remove_const_t<Policy>::kId - 1)) {
    static_assert(settings_bytes<Policy>() == sizeof(Policy),
                  "a policy whose type depends on n may have no state beside its settings");
    Policy::settings([&](const SettingInfo& /*setting*/, auto member) {
      lay_out_setting(stream, member(policy), n);
    });
  } else {
    stream.values(&policy, 1);
  }
}

/// RlsState, member by member. `State` is const where `Stream` is a StateWriter.
template <class Stream, class State>
void lay_out_recursion(Stream& stream, State& state) {
  const auto n = static_cast<std::size_t>(state.factors.size());
  stream.align(alignof(State));
  stream.values(state.theta.data(), n);
  stream.values(state.remainder.data(), n);
  stream.values(state.factors.d.data(), n);
  stream.values(state.factors.u.data(), std::max<std::size_t>(n * (n - 1) / 2, 1));
  lay_out_policy(stream, state.forgetting, n);
  stream.values(state.gain.data(), n);
  lay_out_each(stream, state.innovation, state.forgetting_factor, state.square, state.mean_square,
               state.weight, state.recent_square);
  stream.align(alignof(State));
}

/// OnlineEstimator::Snapshot, member by member.
template <class Stream, class Snapshot>
void lay_out_snapshot(Stream& stream, Snapshot& snapshot) {
  lay_out_each(stream, snapshot.magic, snapshot.version, snapshot.scalar_bytes,
               snapshot.forgetting_id, snapshot.na, snapshot.nb, snapshot.nk, snapshot.offset,
               snapshot.enabled, snapshot.reserved);
  lay_out_recursion(stream, snapshot.recursion);
  lay_out_each(stream, snapshot.history, snapshot.reset, snapshot.convergence);
  stream.align(alignof(Snapshot));
}

}  // namespace ehsid::bindings
