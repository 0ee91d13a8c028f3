// SPDX-License-Identifier: MIT
// Does the servo stand still? At rest a dead band or stiction holds the rod although the command is not zero, so that the
// samples would teach a gain of zero.
#pragma once

#include <ehsid/types.hpp>

#include <cmath>

namespace ehsid {

/// Watches the position in blocks. Two blocks in a row that span less than eight deviations of the noise are a rest.
///
/// The noise is that of the calmest block so far: the mean square of third differences over 20, which is the variance of
/// white noise and to which smooth motion adds little. It may rise by 5 % a block, because noise changes.
template <class Scalar>
class RestDetector {
 public:
  static constexpr Scalar kSpan = Scalar(8);
  static constexpr std::int32_t kCalmBlocks = 2;

  /// block: samples in a block, >= 4.
  void restart(std::int32_t block) {
    *this = RestDetector{};
    block_ = block;
  }

  /// The next position, in sequence.
  void take(Scalar position) {
    const Scalar third =
        seen_ < 3 ? Scalar(0) : position - Scalar(3) * last_[0] + Scalar(3) * last_[1] - last_[2];
    seen_ += seen_ < 3 ? 1 : 0;
    last_ = {position, last_[0], last_[1]};
    if (count_ == 0) {
      low_ = position;
      high_ = position;
      squares_ = Scalar(0);
    }
    low_ = position < low_ ? position : low_;
    high_ = position > high_ ? position : high_;
    squares_ += third * third;
    if (++count_ < block_) {
      return;
    }
    const Scalar variance = squares_ / (Scalar(20) * static_cast<Scalar>(count_));
    const Scalar risen = Scalar(1.05) * noise_;
    noise_ = known_ && risen > Scalar(0) && risen < variance ? risen : variance;
    known_ = true;
    calm_ = high_ - low_ <= threshold(position) ? calm_ + (calm_ < kCalmBlocks ? 1 : 0) : 0;
    count_ = 0;
  }

  bool resting() const { return calm_ >= kCalmBlocks; }
  /// Whether a block began with the last position, and the servo moved in the one before.
  bool begins_after_motion() const { return count_ == 1 && calm_ == 0; }
  /// Samples of standing still after which it is a rest.
  std::int32_t samples() const { return kCalmBlocks * block_; }
  /// Movements up to this are none, about a position; with room for the last digit of a number.
  Scalar threshold(Scalar position) const {
    return kSpan * std::sqrt(noise_) +
           Scalar(4) * std::numeric_limits<Scalar>::epsilon() * std::abs(position);
  }
  template <class Visit>
  EHSID_ALWAYS_INLINE static constexpr void fields(Visit visit) {
    visit(&RestDetector::last_);
    visit(&RestDetector::low_);
    visit(&RestDetector::high_);
    visit(&RestDetector::squares_);
    visit(&RestDetector::noise_);
    visit(&RestDetector::block_);
    visit(&RestDetector::count_);
    visit(&RestDetector::seen_);
    visit(&RestDetector::calm_);
    visit(&RestDetector::known_);
  }

  /// Whether a state that was read can be one of a detector of positions up to `largest`.
  bool possible(Scalar largest) const {
    bool good = block_ >= 4 && count_ >= 0 && count_ < block_ && seen_ >= 0 && seen_ <= 3 &&
                calm_ >= 0 && calm_ <= kCalmBlocks && noise_ >= Scalar(0) && is_finite(noise_) &&
                is_finite(squares_);
    for (const Scalar position : {low_, high_, last_[0], last_[1], last_[2]}) {
      good = std::abs(position) <= largest && good;
    }
    return good;
  }

  /// There was a movement.
  void moved() { calm_ = 0; }

 private:
  std::array<Scalar, 3> last_{};
  Scalar low_ = Scalar(0);
  Scalar high_ = Scalar(0);
  Scalar squares_ = Scalar(0);
  Scalar noise_ = Scalar(0);
  std::int32_t block_ = 0;
  std::int32_t count_ = 0;
  std::int32_t seen_ = 0;
  std::int32_t calm_ = 0;
  bool known_ = false;
};

}  // namespace ehsid
