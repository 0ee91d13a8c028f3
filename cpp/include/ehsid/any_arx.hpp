// SPDX-License-Identifier: MIT
#pragma once

#include <ehsid/fields.hpp>
#include <ehsid/types.hpp>

namespace ehsid {

inline constexpr int kMaxOrder = 6;   // na and nb from 1 on
inline constexpr int kMaxDelay = 20;  // nk from 0 on

/// Past samples for the largest orders and the longest delay.
template <class Scalar>
struct AnyArxState {
  Array<Scalar, kMaxOrder> outputs;
  Array<Scalar, kMaxDelay + kMaxOrder> commands;
  std::int32_t filled;

  template <class Visit>
  EHSID_ALWAYS_INLINE static constexpr void fields(Visit visit) {
    visit(&AnyArxState::outputs, each_output);
    visit(&AnyArxState::commands, each_command);
    visit(&AnyArxState::filled);
  }
};

/// The regressor of ehsid::Arx with orders chosen at run time, for the same OnlineEstimator. Only moves
/// numbers, so results are bit for bit those of Arx<Scalar, na, nb, nk, offset>; a test compares them.
/// For Python and C, where na, nb, nk as template arguments would need 756 estimators for each precision and
/// policy. C has one for each kN, 12; Python one for all, kN = up_to(13).
template <class Scalar_, int kN_>
class AnyArx : Extent<kN_> {
 public:
  using Scalar = Scalar_;
  static constexpr int kN = kN_;
  using State = AnyArxState<Scalar>;
  using Regressor = Vector<Scalar, kN>;
  /// A shape whose state takes as many numbers as that of any can: na + nb + nk of them.
  static constexpr ModelShape kLargest{capacity(kN), 0, kMaxDelay, false};
  static constexpr bool kOrdersAtRunTime = true;
  static constexpr bool kIntegrates = false;

  AnyArx() = default;
  /// na + nb parameters, or na + nb + 1 where kN leaves room for the offset.
  AnyArx(int na, int nb, int nk) : AnyArx(na, nb, nk, na + nb < kN) {}
  /// For kN = up_to(most).
  AnyArx(int na, int nb, int nk, bool offset) : na_(na), nb_(nb), nk_(nk) {
    this->resize(na + nb + (offset ? 1 : 0));
  }

  using Extent<kN_>::size;

  int na() const { return na_; }
  int nb() const { return nb_; }
  int nk() const { return nk_; }
  bool offset() const { return na_ + nb_ < size(); }

  /// Past samples that must have been seen before the regressor is complete.
  int full() const { return na_ > nk_ + nb_ - 1 ? na_ : nk_ + nb_ - 1; }

  void clear() { state_ = State{}; }
  bool ready() const { return state_.filled >= full(); }

  void advance_command(Scalar command) {
    for (std::size_t i = state_.commands.size() - 1; i > 0; --i) {
      state_.commands[i] = state_.commands[i - 1];
    }
    state_.commands[0] = command;
  }

  void advance_output(Scalar output) {
    for (std::size_t i = state_.outputs.size() - 1; i > 0; --i) {
      state_.outputs[i] = state_.outputs[i - 1];
    }
    state_.outputs[0] = output;
    state_.filled = state_.filled < full() ? state_.filled + 1 : full();
  }

  Regressor regressor() const {
    Regressor phi = Regressor::Ones(size());  // the last one stays 1 where there is an offset
    for (int i = 0; i < na_; ++i) {
      phi[i] = -state_.outputs[static_cast<std::size_t>(i)];
    }
    for (int i = 0; i < nb_; ++i) {
      phi[na_ + i] = state_.commands[static_cast<std::size_t>(nk_ + i)];
    }
    return phi;
  }

  const State& state() const { return state_; }

  bool usable(const State& saved) const {
    return all_finite<kMaxOrder>(saved.outputs) &&
           all_finite<kMaxDelay + kMaxOrder>(saved.commands) && saved.filled >= 0 &&
           saved.filled <= full();
  }

  Status restore(const State& saved) {
    if (!usable(saved)) {
      return Status::invalid_argument;
    }
    state_ = saved;
    return Status::ok;
  }

 private:
  int na_ = 1;
  int nb_ = 1;
  int nk_ = 1;
  State state_{};
};

}  // namespace ehsid
