// SPDX-License-Identifier: MIT
// The saved state of a ServoEstimator, and what of such bytes can be the state of one. Part of servo_estimator.hpp.
#pragma once

#include <ehsid/servo_estimator.hpp>

#include <cmath>

namespace ehsid {

template <class Scalar, int kMaxDelay>
SnapshotHeader ServoEstimator<Scalar, kMaxDelay>::header() const {
  ByteStream settings = ByteStream::writing(nullptr);
  stream_fields(settings, shape(options_.delay), options_);
  return {kMagic,
          kSnapshotVersion,
          static_cast<std::uint16_t>(sizeof(Scalar)),
          0,  // no forgetting policy
          shape(options_.delay),
          static_cast<std::uint32_t>(snapshot_bytes()),
          settings.checksum()};
}

template <class Scalar, int kMaxDelay>
SnapshotFault ServoEstimator<Scalar, kMaxDelay>::read(const std::uint8_t* bytes, std::size_t count,
                                                      const Options& own) {
  const SnapshotFault fault = read_snapshot(bytes, count, header(), *this);
  if (fault != SnapshotFault::none) {
    return fault;
  }
  const bool same = options_.dt_s == own.dt_s && options_.delay == own.delay &&
                    options_.drift == own.drift && options_.tolerance == own.tolerance &&
                    per_second_ == Scalar(1) / own.dt_s;
  return same && possible() && saves_as(bytes, count) ? SnapshotFault::none
                                                      : SnapshotFault::impossible;
}

/// Whether save() would write these bytes again: of a bool, for one, only two values do.
template <class Scalar, int kMaxDelay>
bool ServoEstimator<Scalar, kMaxDelay>::saves_as(const std::uint8_t* bytes,
                                                 std::size_t count) const {
  std::uint32_t wanted = 0;
  ByteStream reader = ByteStream::reading(bytes + (count - kChecksumBytes));
  reader.values(&wanted, 1);
  SnapshotHeader own = header();
  ByteStream writer = ByteStream::writing(nullptr);
  stream_fields(writer, own.shape, own);
  stream_fields(writer, own.shape, *this);
  return writer.checksum() == wanted;
}

/// Whether counts and what becomes a whole number are in the ranges in which a step leaves them, and what is told is
/// finite. Sums and filters may hold numbers that are not: hostile samples do that, and all begins anew then.
template <class Scalar, int kMaxDelay>
bool ServoEstimator<Scalar, kMaxDelay>::possible() const {
  bool good = rest_.possible(kLargest) && run_.possible() && sine_.possible() &&
              filter_.possible() && phase_ <= Phase::tracking &&
              (phase_ == Phase::waiting || filter_.started()) && std::abs(sign_) == Scalar(1) &&
              delay_ >= options_.delay && delay_ <= options_.delay + 1 && leader_ >= -1 &&
              (phase_ != Phase::tracking || leader_ == 0 || leader_ == 1) &&
              leader_ < Starts::kStarts && starts_.possible();
  for (const Scalar sum :
       {command_square_, least_noise_, thirds_, paths_, pulls_, pushed_, together_, peak_}) {
    good = is_finite(sum) && good;
  }
  for (const Scalar position :
       {before_, reference_, rest_position_, low_, high_, last_[0], last_[1]}) {
    good = std::abs(position) <= kLargest && good;
  }
  for (const Scalar command : commands_) {
    good = std::abs(command) <= kLargest && good;
  }
  for (const std::int32_t count :
       {averaged_, waited_, peak_samples_, tracked_, settling_, cooling_, resets_}) {
    good = count >= 0 && count <= kMostSamples && good;
  }
  const TrackedServo<Scalar> told = servo();
  for (const auto* value : {&told.gain, &told.omega_n, &told.xi}) {
    const bool none = value->value != value->value;
    good = (none || (is_finite(value->value) && is_finite(value->half_width))) && good;
  }
  return good;
}

}  // namespace ehsid
