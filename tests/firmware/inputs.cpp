// SPDX-License-Identifier: MIT
// NaN, Inf, huge and denormal numbers at a running estimator: the status says so, the estimate rests bit for
// bit, and estimation goes on afterwards. States are printed as hashes: the host must print the same.
#include "golden_trace.hpp"
#include "signal.hpp"

namespace {

using firmware::number;
using firmware::Report;
using firmware::Signal;

struct Bad {
  std::uint32_t bits;  // of the float32; a float here would need a constructor before main()
  ehsid::Status status;
};

const Bad kRefused[] = {
    {0x7fc00000U, ehsid::Status::invalid_input},  // quiet NaN
    {0xffc00001U, ehsid::Status::invalid_input},
    {0x7f800001U, ehsid::Status::invalid_input},  // signalling NaN
    {0x7f800000U, ehsid::Status::invalid_input},  // Inf
    {0xff800000U, ehsid::Status::invalid_input},
    {0x7f7fffffU, ehsid::Status::out_of_range},  // largest float32
    {0xff7fffffU, ehsid::Status::out_of_range},
    {0x60ad78ecU, ehsid::Status::out_of_range},  // 1e20
    {0xc62be000U, ehsid::Status::out_of_range},  // -11000; the limit of scaled signals is 1e4
};
// The smallest and other denormal numbers, and minus zero.
const std::uint32_t kTiny[] = {0x00000001U, 0x80000001U, 0x007fffffU, 0x00400000U, 0x80000000U};

template <class State>
std::uint32_t hash(const State& state) {
  return firmware::hash(&state, sizeof state);
}

/// Everything but the history of samples, which a lost sample empties on purpose.
template <class Estimator>
std::uint32_t estimate_of(const Estimator& estimator) {
  const auto& reset = estimator.change_detector().state();  // word by word: it ends in padding
  const std::uint32_t words[] = {
      hash(estimator.recursion().state()),      hash(estimator.monitor().state()),
      firmware::bits(reset.short_square),       firmware::bits(reset.long_square),
      static_cast<std::uint32_t>(reset.seen),   static_cast<std::uint32_t>(reset.cooling),
      static_cast<std::uint32_t>(reset.alarms), reset.armed};
  return hash(words);
}

/// Samples without a bad one; the last must be estimated.
template <class Estimator>
void go_on(Estimator& estimator, Signal& signal, int samples, const char* policy, Report& report) {
  ehsid::Status status = ehsid::Status::filling;
  for (int i = 0; i < samples; ++i) {
    const firmware::Sample sample = signal.next();
    status = estimator.step(sample.command, sample.position);
  }
  report.check(!ehsid::is_error(status) && status != ehsid::Status::filling, policy,
               "estimation does not go on",
               static_cast<std::uint32_t>(estimator.monitor().samples()));
}

template <class Estimator>
void refused(Estimator& estimator, Signal& signal, const char* policy, Report& report) {
  std::uint32_t place = 0;
  for (const Bad& bad : kRefused) {
    for (const bool as_command : {true, false}) {
      const std::uint32_t before = estimate_of(estimator);
      const firmware::Sample sample = signal.next();
      const ehsid::Status status = estimator.step(as_command ? number(bad.bits) : sample.command,
                                                  as_command ? sample.position : number(bad.bits));
      report.check(status == bad.status, policy, "status of a refused input", place);
      report.check(estimate_of(estimator) == before, policy, "a refused input changed the estimate",
                   place);
      go_on(estimator, signal, 5, policy, report);  // three to fill the history, two to estimate
      ++place;
    }
  }
}

template <class Estimator>
void tiny(Estimator& estimator, Signal& signal, const char* policy, Report& report) {
  std::uint32_t place = 0;
  for (const std::uint32_t word : kTiny) {
    for (const bool as_command : {true, false}) {
      const firmware::Sample sample = signal.next();
      const ehsid::Status status = estimator.step(as_command ? number(word) : sample.command,
                                                  as_command ? sample.position : number(word));
      report.check(!ehsid::is_error(status), policy, "a tiny input is no error", place);
      report.check(Estimator::Recursion::usable(estimator.recursion().state()), policy,
                   "a tiny input spoilt the state", place);
      ++place;
    }
  }
  for (int i = 0; i < 12; ++i) {  // a regressor of nothing else
    const ehsid::Status status = estimator.step(number(kTiny[0]), number(kTiny[3]));
    report.check(!ehsid::is_error(status), policy, "tiny inputs are no error", place);
  }
  go_on(estimator, signal, 5, policy, report);
}

/// The recursion alone, where no range protects it: phi' P phi overflows.
template <class Forgetting>
void overflow(const char* policy, Report& report) {
  ehsid::Rls<float, 6, Forgetting> rls;
  for (const float value : {1e30F, -1e25F, 3e38F}) {
    const std::uint32_t before = hash(rls.state());
    const ehsid::Status status = rls.update(ehsid::Vector<float, 6>::Constant(value), value);
    report.check(status == ehsid::Status::numerical_limit, policy, "status of an overflow", 0);
    report.check(hash(rls.state()) == before, policy, "an overflow changed the state", 0);
  }
}

template <class Forgetting>
[[gnu::noinline]] void run(const char* policy, Report& report) {
  firmware::Estimator<Forgetting> estimator;
  Signal signal;
  go_on(estimator, signal, 60, policy, report);
  refused(estimator, signal, policy, report);
  tiny(estimator, signal, policy, report);
  overflow<Forgetting>(policy, report);
  firmware::put(policy);
  firmware::put(" ");
  firmware::put_hexadecimal(estimate_of(estimator));
  firmware::put("\n");
}

}  // namespace

int main() {
  port::start();
  Report report;
  firmware::every_policy(
      [&](auto policy, const char* name) { run<decltype(policy)>(name, report); });
  return report.finish();
}
