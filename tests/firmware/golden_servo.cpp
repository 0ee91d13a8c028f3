// SPDX-License-Identifier: MIT
// The golden trace of ServoEstimator, sample by sample: what it tells, and the checksum of its saved state, bit for bit as
// on the host. Every 50 samples another estimator goes on from the saved state.
#include <ehsid/servo_estimator.hpp>

#include "golden_trace.hpp"

namespace {

using Estimator = ehsid::ServoEstimator<float>;
using Row = firmware::AnyRow<13>;

Estimator estimators[2];
std::uint8_t state[Estimator::most_snapshot_bytes()];

bool step_as_traced(Estimator& estimator, const Row& row, const char* run, std::uint32_t sample,
                    firmware::Report& report) {
  const ehsid::Status status =
      estimator.step(firmware::number(row.words[0]), firmware::number(row.words[1]));
  const ehsid::TrackedServo<float> told = estimator.servo();
  const std::uint32_t* word = row.words + 3;
  bool same = true;
  for (const auto* value : {&told.gain, &told.omega_n, &told.xi}) {
    same = firmware::bits(value->value) == *word++ && same;
    same = firmware::bits(value->half_width) == *word++ && same;
    same = static_cast<std::uint32_t>(value->reason) == *word++ && same;
  }
  estimator.save(state);
  std::uint32_t checksum = 0;
  for (std::size_t i = estimator.snapshot_bytes(), byte = 0; byte < 4; ++byte) {
    checksum = checksum << 8U | state[--i];
  }
  // Not &&: all that differs is reported.
  bool good = report.check(row.is_of(run), run, "row of another run", sample);
  good &= report.check(static_cast<std::uint32_t>(status) == row.words[2], run, "status", sample);
  good &= report.check(same, run, "K, omega_n or xi", sample);
  good &= report.check(checksum == *word, run, "state", sample);
  return good;
}

void replay(firmware::Trace& trace, const char* run, std::uint32_t samples,
            const Estimator::Options& options, firmware::Report& report) {
  Estimator* estimator = &estimators[0];
  bool good =
      report.check(estimator->configure(options) == ehsid::Status::ok, run, "configuration", 0);
  for (std::uint32_t sample = 0; sample < samples; ++sample) {
    Row row{};
    if (!report.check(trace.next(row), run, "unreadable row", sample)) {
      return;
    }
    if (good && sample > 0 && sample % 50 == 0) {
      const std::size_t bytes = estimator->snapshot_bytes();
      estimator = &estimators[sample / 50 % 2];
      good = report.check(estimator->configure(options) == ehsid::Status::ok &&
                              estimator->restore(state, bytes) == ehsid::Status::ok,
                          run, "state refused", sample);
    }
    // Behind the first difference everything differs: one place is enough.
    good = good && step_as_traced(*estimator, row, run, sample, report);
  }
}

}  // namespace

int main() {
  port::start();
  firmware::Report report;
  firmware::Trace trace;
  replay(trace, "steps", 1100, {0.01F}, report);
  replay(trace, "sine", 600, {0.01F, 3, 0.05F, 0.25F}, report);
  report.check(trace.at_end(), "trace", "rows left over", 0);
  return report.finish();
}
