// SPDX-License-Identifier: MIT
// Regressor of the ARX model, Eqs. (7)-(8) of Ghazali et al. (2011):
//   A(q^-1) y(k) = q^-nk B(q^-1) u(k) + e(k),
//   phi(k) = (-y(k-1) .. -y(k-na), u(k-nk) .. u(k-nk-nb+1) [, 1]),  theta = (a1 .. a_na, b1 .. b_nb [, c]).
#pragma once

#include <ehsid/fields.hpp>
#include <ehsid/types.hpp>

namespace ehsid {

/// Past samples of an ARX model, newest first. Plain data.
template <class Scalar, int kOutputs, int kCommands>
struct ArxState {
  Array<Scalar, kOutputs> outputs;    // y(k-1) .. y(k-na)
  Array<Scalar, kCommands> commands;  // u(k) .. u(k-nk-nb+1)
  std::int32_t filled;                // complete past samples, up to kFull

  template <class Visit>
  EHSID_ALWAYS_INLINE static constexpr void fields(Visit visit) {
    visit(&ArxState::outputs);
    visit(&ArxState::commands);
    visit(&ArxState::filled);
  }
};

/// ARX model of order na, nb and delay nk; with kOffset a constant term c is appended, so that means need
/// not be removed. One sample is: advance_command(u(k)), then regressor(), then advance_output(y(k)).
/// With nk >= 1 the command u(k), which acts over [t_k, t_k+1), does not touch y(k).
template <class Scalar_, int kNa_, int kNb_, int kNk_, bool kOffset_ = false>
class Arx {
 public:
  using Scalar = Scalar_;
  static constexpr int kNa = kNa_;
  static constexpr int kNb = kNb_;
  static constexpr int kNk = kNk_;
  static constexpr bool kOffset = kOffset_;
  static constexpr int kN = kNa + kNb + (kOffset ? 1 : 0);

  static_assert(kNa >= 1, "Arx: na, the number of past outputs, must be at least 1");
  static_assert(kNb >= 1, "Arx: nb, the number of past commands, must be at least 1");
  static_assert(kNk >= 0, "Arx: nk, the delay in samples, must not be negative");

  /// Past samples that must have been seen before the regressor is complete.
  static constexpr int kFull = kNa > kNk + kNb - 1 ? kNa : kNk + kNb - 1;

  using State = ArxState<Scalar, kNa, kNk + kNb>;
  using Regressor = Vector<Scalar, kN>;
  using Parameters = Vector<Scalar, kN>;

  int na() const { return kNa; }
  int nb() const { return kNb; }
  int nk() const { return kNk; }
  bool offset() const { return kOffset; }
  static constexpr int size() { return kN; }
  static constexpr int full() { return kFull; }
  /// The shape of the largest state, and of any.
  static constexpr ModelShape kLargest{kNa, kNb, kNk, kOffset};
  /// Its orders are those of its type.
  static constexpr bool kOrdersAtRunTime = false;
  /// The regressor explains y(k) itself, see integrating.hpp.
  static constexpr bool kIntegrates = false;

  /// Forgets all past samples: after a gap the regressor has to fill anew.
  void clear() { state_ = State{}; }

  /// Is regressor() made of real samples only? Ask after advance_command().
  bool ready() const { return state_.filled >= kFull; }

  /// u(k) joins the history.
  void advance_command(Scalar command) {
    for (std::size_t i = state_.commands.size() - 1; i > 0; --i) {
      state_.commands[i] = state_.commands[i - 1];
    }
    state_.commands[0] = command;
  }

  /// y(k) joins the history and closes the sample.
  void advance_output(Scalar output) {
    for (std::size_t i = state_.outputs.size() - 1; i > 0; --i) {
      state_.outputs[i] = state_.outputs[i - 1];
    }
    state_.outputs[0] = output;
    state_.filled = state_.filled < kFull ? state_.filled + 1 : kFull;
  }

  /// phi(k), Eq. (8), between advance_command(u(k)) and advance_output(y(k)).
  Regressor regressor() const {
    Regressor phi;
    for (int i = 0; i < kNa; ++i) {
      phi[i] = -state_.outputs[static_cast<std::size_t>(i)];
    }
    for (int i = 0; i < kNb; ++i) {
      phi[kNa + i] = state_.commands[static_cast<std::size_t>(kNk + i)];
    }
    if constexpr (kOffset) {
      phi[kN - 1] = Scalar(1);
    }
    return phi;
  }

  /// y(k) predicted from the past, phi'(k) theta.
  Scalar predict(const Parameters& theta) const { return dot<kN>(regressor(), theta); }

  /// y(k+1) .. y(k+kSteps) predicted after sample k is closed, on commands u(k+1) .. u(k+kSteps);
  /// predictions take the place of outputs that are not known yet. Predictions of an unstable theta stop at the largest
  /// number whose square is finite.
  template <int kSteps>
  Vector<Scalar, kSteps> predict_ahead(const Parameters& theta,
                                       const Vector<Scalar, kSteps>& commands) const {
    static_assert(kSteps >= 1, "Arx: predict at least one step ahead");
    Arx ahead = *this;
    Vector<Scalar, kSteps> outputs;
    for (int i = 0; i < kSteps; ++i) {
      ahead.advance_command(commands[i]);
      outputs[i] = limited(ahead.predict(theta));
      ahead.advance_output(outputs[i]);
    }
    return outputs;
  }

  const State& state() const { return state_; }

  /// May this saved state be taken over?
  static bool usable(const State& saved) {
    return all_finite<kNa>(saved.outputs) && all_finite<kNk + kNb>(saved.commands) &&
           saved.filled >= 0 && saved.filled <= kFull;
  }

  /// Takes a saved state over; invalid_argument, and nothing changed, unless it is usable.
  Status restore(const State& saved) {
    if (!usable(saved)) {
      return Status::invalid_argument;
    }
    state_ = saved;
    return Status::ok;
  }

 private:
  /// NaN, of infinite terms that cancel, becomes the limit, too.
  static Scalar limited(Scalar output) {
    constexpr Scalar kMost = sizeof(Scalar) == sizeof(float) ? Scalar(9e18F) : Scalar(6e153);
    if (is_squarable(output)) {
      return output;
    }
    return output < Scalar(0) ? -kMost : kMost;
  }

  State state_{};
};

}  // namespace ehsid
