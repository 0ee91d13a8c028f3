// SPDX-License-Identifier: MIT
// A model whose integrator is known, as that of a servo is:
//
//   A(q^-1) (y(k) - y(k-1)) = q^-nk B(q^-1) u(k) + c + e(k)
//
// Its two sides go through 1 / (1 - fade q^-1), so that noise of the position is not amplified as by a plain difference.
// That leaves A, B and c as they are. A pole less is estimated, and the position may be anywhere, or run away.
#pragma once

#include <ehsid/arx.hpp>
#include <ehsid/arx_estimator.hpp>
#include <ehsid/fields.hpp>
#include <ehsid/types.hpp>

namespace ehsid {

/// The samples of the model, which are differences of the position, and what the filters hold. Plain data.
template <class Model>
struct IntegratingState {
  using Scalar = typename Model::Scalar;

  typename Model::State samples;
  Array<Scalar, Model::kN> regressor;  // filtered phi(k)
  Scalar output;                       // filtered y(k-1) - y(k-2)
  Scalar position;                     // y(k-1)
  std::uint8_t started;                // is there a y(k-1)?

  template <class Visit>
  EHSID_ALWAYS_INLINE static constexpr void fields(Visit visit) {
    visit(&IntegratingState::samples);
    visit(&IntegratingState::regressor, each_parameter);
    visit(&IntegratingState::output);
    visit(&IntegratingState::position);
    visit(&IntegratingState::started);
  }
};

/// Arx or AnyArx, of na poles beside the integrator. Takes their place in OnlineEstimator, with any recursion.
///
/// The filters start from zero with the first complete regressor: their rows are sums of rows that hold exactly, so
/// nothing has to die away.
template <class Model_>
class Integrating {
 public:
  using Scalar = typename Model_::Scalar;
  static constexpr int kN = Model_::kN;
  using State = IntegratingState<Model_>;
  using Regressor = typename Model_::Regressor;
  static constexpr ModelShape kLargest = Model_::kLargest;
  static constexpr bool kOrdersAtRunTime = Model_::kOrdersAtRunTime;
  static constexpr bool kIntegrates = true;
  /// A memory of twenty samples. 0.8 to 0.98 give the same K.
  static constexpr Scalar kFade = Scalar(0.95);

  Integrating() = default;
  explicit Integrating(const Model_& model) : model_(model) {}

  int na() const { return model_.na(); }
  int nb() const { return model_.nb(); }
  int nk() const { return model_.nk(); }
  int size() const { return model_.size(); }
  bool offset() const { return model_.offset(); }

  void clear() {
    model_.clear();
    regressor_.fill(Scalar(0));
    output_ = Scalar(0);
    started_ = false;
  }
  bool ready() const { return model_.ready(); }

  void advance_command(Scalar command) {
    model_.advance_command(command);
    if (ready()) {
      const Regressor phi = model_.regressor();
      for (int i = 0; i < size(); ++i) {
        Scalar& filtered = regressor_[static_cast<std::size_t>(i)];
        filtered = kFade * filtered + phi[i];
      }
    }
  }
  /// What the regressor explains of this position.
  Scalar output(Scalar position) const { return kFade * output_ + (position - position_); }
  void advance_output(Scalar position) {
    if (ready()) {
      output_ = output(position);
    }
    if (started_) {
      model_.advance_output(position - position_);
    }
    position_ = position;
    started_ = true;
  }

  /// y(k+1) .. y(k+kSteps), as Arx::predict_ahead().
  template <int kSteps>
  Vector<Scalar, kSteps> predict_ahead(const Regressor& theta,
                                       const Vector<Scalar, kSteps>& commands) const {
    Vector<Scalar, kSteps> positions = model_.template predict_ahead<kSteps>(theta, commands);
    Scalar position = position_;
    for (int i = 0; i < kSteps; ++i) {
      position += positions[i];
      positions[i] = position;
    }
    return positions;
  }

  Regressor regressor() const { return to_vector<kN>(size(), regressor_); }

  State state() const {
    return {model_.state(), regressor_, output_, position_,
            static_cast<std::uint8_t>(started_ ? 1 : 0)};
  }

  bool usable(const State& saved) const {
    return model_.usable(saved.samples) && all_squarable(size(), saved.regressor) &&
           is_squarable(saved.output) && is_squarable(saved.position) && saved.started <= 1;
  }

  Status restore(const State& saved) {
    if (!usable(saved)) {
      return Status::invalid_argument;
    }
    regressor_ = saved.regressor;
    output_ = saved.output;
    position_ = saved.position;
    started_ = saved.started == 1;
    return model_.restore(saved.samples);
  }

 private:
  Model_ model_{};
  Array<Scalar, kN> regressor_{};
  Scalar output_{};
  Scalar position_{};
  bool started_ = false;
};

/// ArxEstimator of a plant that integrates, as a servo does, with na poles beside the integrator. kOffset lets the null of
/// its valve be anywhere.
///
/// The long way of the position shows its gain, whatever the noise of the sensor: it is right where that of ArxEstimator is
/// not, see docs/which_estimator.md. The poles are as biased as there.
template <class Scalar, int kNa, int kNb, int kNk, class Forgetting = FRatio<Scalar>,
          bool kOffset = false>
using IntegratingRlsEstimator =
    OnlineEstimator<Integrating<Arx<Scalar, kNa, kNb, kNk, kOffset>>, Forgetting>;

}  // namespace ehsid
