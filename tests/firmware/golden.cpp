// SPDX-License-Identifier: MIT
// The golden trace of the host, sample by sample and policy by policy: bit for bit the same here.
#include "golden_trace.hpp"

namespace {

template <class Forgetting>
[[gnu::noinline]] void replay(firmware::Trace& trace, const char* policy,
                              firmware::Report& report) {
  firmware::Estimator<Forgetting> estimator;
  bool good = report.check(firmware::configure_golden(estimator) == ehsid::Status::ok, policy,
                           "configuration", 0);
  for (std::uint32_t sample = 0; sample < firmware::kSamples; ++sample) {
    firmware::Row row{};
    if (!report.check(trace.next(row), policy, "unreadable row", sample)) {
      return;
    }
    // Behind the first difference everything differs: one place is enough.
    good = good && firmware::step_as_traced(estimator, row, policy, sample, report);
  }
}

}  // namespace

int main() {
  port::start();
  firmware::Report report;
  firmware::Trace trace;
  firmware::every_policy(
      [&](auto policy, const char* name) { replay<decltype(policy)>(trace, name, report); });
  report.check(trace.at_end(), "trace", "rows left over", 0);
  return report.finish();
}
