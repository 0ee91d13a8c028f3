// SPDX-License-Identifier: MIT
// Is the command one sine? It then shows two numbers of the servo, size and phase of the response, and no more: K can be
// told where the sine is slow, omega_n and xi cannot.
#pragma once

#include <ehsid/bounded_math.hpp>
#include <ehsid/types.hpp>

namespace ehsid {

/// A sine obeys u(j) + u(j-2) = c u(j-1) + constant with c = 2 cos(angle), whatever its phase. Fitted by least squares over
/// about five seconds, at samples that lie 1 / omega_n apart.
template <class Scalar>
class SingleSine {
 public:
  /// Largest share of the left side's variance that is left where the command is a sine, and the least share where it is
  /// clearly none.
  static constexpr Scalar kLeft = Scalar(0.003);
  static constexpr Scalar kClear = Scalar(0.01);

  /// The next command. spacing: samples between those that are used, >= 1; forgotten: share of what was, in a sample.
  void take(Scalar command, std::int32_t spacing, Scalar forgotten) {
    if (++count_ < spacing) {
      return;
    }
    count_ = 0;
    const Scalar keep = bounded_exp(-static_cast<Scalar>(spacing) * forgotten);
    const Scalar left = command + before_;
    weight_ = keep * weight_ + Scalar(1);
    // Means and central moments with forgetting, which lose no digits to a large constant.
    const Scalar share = Scalar(1) / weight_;
    const Scalar dx = last_ - mean_x_;
    const Scalar dy = left - mean_y_;
    mean_x_ += share * dx;
    mean_y_ += share * dy;
    const Scalar rest = Scalar(1) - share;
    xx_ = rest * (xx_ + share * dx * dx);
    xy_ = rest * (xy_ + share * dx * dy);
    yy_ = rest * (yy_ + share * dy * dy);
    before_ = last_;
    last_ = command;
    const Scalar least = std::numeric_limits<Scalar>::min();
    const Scalar slope = xx_ > least ? xy_ / xx_ : Scalar(0);
    left_ = yy_ > least ? (yy_ - slope * xy_) / yy_ : Scalar(1);
    // 2 - 2 cos(a) = a^2 (1 - a^2 / 12 ...)
    const Scalar x = slope < Scalar(2) ? Scalar(2) - slope : Scalar(0);
    const auto apart = static_cast<Scalar>(spacing);
    square_ = x * (Scalar(1) + x / Scalar(12)) / (apart * apart);
    samples_not_sine_ = sine() || !known() ? 0 : samples_not_sine_ + spacing;
    if (samples_not_sine_ > kMostCount) {
      samples_not_sine_ = kMostCount;
    }
  }

  bool sine() const { return left_ < kLeft && weight_ > Scalar(4); }
  /// Whether the command is clearly none, and for how many samples it has been no sine.
  bool clearly_none() const { return known() && left_ > kClear; }
  std::int32_t samples_not_sine() const { return samples_not_sine_; }
  template <class Visit>
  EHSID_ALWAYS_INLINE static constexpr void fields(Visit visit) {
    visit(&SingleSine::last_);
    visit(&SingleSine::before_);
    visit(&SingleSine::mean_x_);
    visit(&SingleSine::mean_y_);
    visit(&SingleSine::xx_);
    visit(&SingleSine::xy_);
    visit(&SingleSine::yy_);
    visit(&SingleSine::weight_);
    visit(&SingleSine::left_);
    visit(&SingleSine::square_);
    visit(&SingleSine::count_);
    visit(&SingleSine::samples_not_sine_);
  }

  /// Whether a state that was read can be one of a command.
  bool possible() const {
    return count_ >= 0 && count_ <= kMostCount && samples_not_sine_ >= 0 &&
           samples_not_sine_ <= kMostCount;
  }

  /// Square of the angle of the sine in one sample.
  Scalar squared_angle() const { return square_; }

 private:
  static constexpr std::int32_t kMostCount = 1000000000;

  bool known() const { return weight_ > Scalar(8); }

  Scalar last_ = Scalar(0);
  Scalar before_ = Scalar(0);
  Scalar mean_x_ = Scalar(0);
  Scalar mean_y_ = Scalar(0);
  Scalar xx_ = Scalar(0);
  Scalar xy_ = Scalar(0);
  Scalar yy_ = Scalar(0);
  Scalar weight_ = Scalar(0);
  Scalar left_ = Scalar(0);
  Scalar square_ = Scalar(0);
  std::int32_t count_ = 0;
  std::int32_t samples_not_sine_ = 0;
};

}  // namespace ehsid
