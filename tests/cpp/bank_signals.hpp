// SPDX-License-Identifier: MIT
// Records of many machines at once, with everything that sends an estimator through its branches.
#pragma once

#include <cmath>
#include <cstddef>
#include <limits>
#include <random>
#include <vector>

namespace test {

/// Commands and positions, a row of `lanes` numbers for each sample.
template <class Scalar>
struct BankRecord {
  std::size_t samples;
  std::size_t lanes;
  std::vector<Scalar> commands;
  std::vector<Scalar> positions;
};

/// Each lane is a third-order machine of its own with noise. It is excited, then held so long that the estimator runs out of
/// patience, then excited as another plant. Single lanes get NaN, infinite, huge and implausible numbers.
template <class Scalar>
BankRecord<Scalar> bank_record(std::size_t samples, std::size_t lanes, unsigned seed) {
  BankRecord<Scalar> record{samples, lanes, {}, {}};
  record.commands.resize(samples * lanes);
  record.positions.resize(samples * lanes);
  std::mt19937 random(seed);
  std::normal_distribution<double> normal;
  for (std::size_t lane = 0; lane < lanes; ++lane) {
    const double noise = std::pow(10.0, -4.0 + 0.1 * static_cast<double>(lane % 21));
    const double pole = 0.5 + 0.4 * static_cast<double>(lane % 7) / 7.0;
    double y1 = 0.0;
    double y2 = 0.0;
    double u1 = 0.0;
    for (std::size_t k = 0; k < samples; ++k) {
      const bool held = k > samples / 3 + 5 * lane && k < samples / 2 + 11 * lane;
      const double gain = k > 2 * samples / 3 + lane ? 0.7 : 0.2;
      const double u = held ? (lane % 3 == 0 ? 0.0 : 0.3) : normal(random);
      const double quiet = held && lane % 4 == 1 ? 0.01 : 1.0;
      const double y =
          (pole + 0.3) * y1 - 0.3 * pole * y2 + gain * u1 + quiet * noise * normal(random);
      y2 = y1;
      y1 = y;
      u1 = u;
      record.commands[k * lanes + lane] = static_cast<Scalar>(u);
      record.positions[k * lanes + lane] = static_cast<Scalar>(y);
    }
  }
  // Not a multiple of anything, so that each lane meets them at another moment.
  const Scalar bad[] = {std::numeric_limits<Scalar>::quiet_NaN(),
                        std::numeric_limits<Scalar>::infinity(),
                        -std::numeric_limits<Scalar>::max(), Scalar(3e5), Scalar(9e3)};
  std::size_t which = 0;
  for (std::size_t at = 997; at < samples * lanes; at += 1483) {
    (which % 2 == 0 ? record.commands : record.positions)[at] = bad[which % 5];
    ++which;
  }
  return record;
}

}  // namespace test
