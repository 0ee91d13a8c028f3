// SPDX-License-Identifier: MIT
// A float32 estimator of one policy on a command that is held for up to 1e9 samples, and its way back.
//
//   soak_held POLICY reset|no_reset STATE_FILE SECONDS [UPDATES]
//
// First 2000 samples with a random command, then the command is held at 0.5. At 0, 1e6, 1e7, 1e8 and 1e9 held samples
// copies of the estimator see the plant with b 50 % larger, under 41 random commands. Goes on from STATE_FILE, which it
// writes at the end; prints what was measured so far as JSON. UPDATES: no more than so many held ones (1e9).
#include "model.hpp"

#include <ehsid/c_api.h>
#include <ehsid/types.hpp>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <string>
#include <type_traits>

namespace {

constexpr std::uint64_t kExcited = 2000;
constexpr std::array<std::uint64_t, 5> kCheckpoints = {0, 1'000'000, 10'000'000, 100'000'000,
                                                       1'000'000'000};
constexpr int kReturns = 41;     // odd: the median is one of them
constexpr int kMostBack = 3000;  // samples; who is not back by then does not come back
constexpr int kStays = 50;       // samples within 1 % until it counts as back
constexpr double kChange = 1.5;

[[noreturn]] void fail(const char* what) {
  std::fprintf(stderr, "soak_held: %s\n", what);
  std::exit(2);
}

struct Policy {
  const char* name;
  const ehsid_kernel* kernel;
};
#define SOAK_POLICY(policy) {#policy, EHSID_KERNEL(policy, 6)},
constexpr Policy kPolicies[] = {EHSID_EACH_POLICY(SOAK_POLICY)};
#undef SOAK_POLICY

/// Without padding, whose bytes would have no value: files of equal states must be equal.
struct Snapshot {
  static constexpr std::size_t kWord = sizeof(std::uint64_t);
  std::array<unsigned char, (EHSID_SNAPSHOT_BYTES(soak::kN) + kWord - 1) / kWord * kWord> bytes{};
  std::uint64_t count = 0;
};
static_assert(std::has_unique_object_representations<Snapshot>::value, "no padding");

class Estimator {
 public:
  Estimator(const ehsid_kernel* kernel, bool reset) {
    ehsid_configuration configuration;
    if (ehsid_default_configuration(&configuration, kernel, 3, 3, 1, false) != EHSID_OK) {
      fail("no configuration");
    }
    configuration.reset_enabled = reset;
    if (ehsid_init(&estimator_, storage_, sizeof storage_, &configuration) != EHSID_OK) {
      fail("no estimator");
    }
  }

  ehsid_status step(double command, float position) {
    return ehsid_step(estimator_, static_cast<float>(command), position);
  }
  std::array<float, soak::kN> theta() const {
    std::array<float, soak::kN> values{};
    static_cast<void>(ehsid_theta(estimator_, values.data(), values.size()));
    return values;
  }
  bool finite() const {
    std::array<float, soak::kN> deviation{};
    static_cast<void>(ehsid_standard_deviation(estimator_, deviation.data(), deviation.size()));
    return ehsid::all_finite<soak::kN>(theta()) && ehsid::all_finite<soak::kN>(deviation);
  }
  float excitation() const {
    ehsid_report report = {};
    static_cast<void>(ehsid_read(estimator_, &report));
    return report.excitation;
  }

  Snapshot save() const {
    Snapshot saved;
    std::size_t count = 0;
    if (ehsid_save(estimator_, saved.bytes.data(), saved.bytes.size(), &count) != EHSID_OK) {
      fail("the estimator cannot be saved");
    }
    saved.count = count;
    return saved;
  }
  bool restore(const Snapshot& saved) {
    return ehsid_restore(estimator_, saved.bytes.data(), static_cast<std::size_t>(saved.count)) ==
           EHSID_OK;
  }

 private:
  std::uint64_t storage_[EHSID_STORAGE_WORDS(soak::kN)] = {};
  ehsid_estimator* estimator_ = nullptr;
};

/// What was seen at a number of held samples.
struct Seen {
  std::int32_t median_back;  // samples until within 1 %; kMostBack: never
  std::int32_t worst_back;
  float moved;          // largest change of a parameter during the hold
  float excitation;     // what the estimator reports
  std::int32_t finite;  // 1 or 0; no bool, whose padding would have no value
};

/// All that goes on in the next call. Plain data.
struct Soak {
  char head[16] = "ehsid soak 1";
  soak::Model model{1};
  std::uint64_t held = 0;
  std::uint64_t errors = 0;  // held samples that were answered with an error
  std::array<float, soak::kN> theta_before{};
  std::uint32_t checkpoints = 0;  // passed
  std::array<Seen, kCheckpoints.size()> seen{};
  Snapshot estimator{};
};

/// Samples until every parameter stays within 1 % of the changed plant.
int samples_back(const Soak& soak, Estimator& estimator, std::uint64_t seed) {
  if (!estimator.restore(soak.estimator)) {
    fail("an estimator does not take over its own state");
  }
  soak::Model model = soak.model;
  model.reseed(seed);
  model.change(kChange);
  int outside = -1;  // the last sample that was
  for (int k = 0; k < kMostBack && k - outside <= kStays; ++k) {
    model.advance();
    const double command = model.sign();
    static_cast<void>(estimator.step(command, model.position()));
    model.command(command);
    const std::array<float, soak::kN> theta = estimator.theta();
    for (int i = 0; i < soak::kN; ++i) {
      const double truth = model.truth(i);
      const double error = static_cast<double>(theta[static_cast<std::size_t>(i)]) - truth;
      // Not `error > ..`: of NaN that would be false.
      if (!(std::fabs(error) <= 0.01 * std::fabs(truth))) {
        outside = k;
      }
    }
  }
  return std::min(outside + 1, kMostBack);
}

Seen look(const Soak& soak, const Estimator& held, Estimator& copy) {
  std::array<int, kReturns> back{};
  for (std::size_t i = 0; i < back.size(); ++i) {
    back[i] = samples_back(soak, copy, 100 + i);
  }
  std::sort(back.begin(), back.end());
  Seen seen{};
  seen.median_back = back[kReturns / 2];
  seen.worst_back = back.back();
  const std::array<float, soak::kN> theta = held.theta();
  for (std::size_t i = 0; i < theta.size(); ++i) {
    seen.moved = std::max(seen.moved, std::fabs(theta[i] - soak.theta_before[i]));
  }
  seen.excitation = held.excitation();
  seen.finite = held.finite() ? 1 : 0;
  return seen;
}

void excite(Soak& soak, Estimator& estimator) {
  for (std::uint64_t k = 0; k < kExcited; ++k) {
    soak.model.advance();
    const double command = soak.model.sign();
    static_cast<void>(estimator.step(command, soak.model.position()));
    soak.model.command(command);
  }
  soak.theta_before = estimator.theta();
}

bool read(const char* path, Soak& soak) {
  std::FILE* file = std::fopen(path, "rb");
  if (file == nullptr) {
    return false;
  }
  Soak found;
  const bool whole = std::fread(static_cast<void*>(&found), sizeof found, 1, file) == 1 &&
                     std::memcmp(found.head, soak.head, sizeof soak.head) == 0;
  static_cast<void>(std::fclose(file));
  if (whole) {
    soak = found;
  }
  return whole;
}

/// Aside, then under its name: who is killed meanwhile leaves the state of before.
void write(const std::string& path, const Soak& soak) {
  const std::string part = path + ".part";
  std::FILE* file = std::fopen(part.c_str(), "wb");
  const bool written = file != nullptr && std::fwrite(&soak, sizeof soak, 1, file) == 1;
  if (file == nullptr || std::fclose(file) != 0 || !written ||
      std::rename(part.c_str(), path.c_str()) != 0) {
    fail("the state cannot be written");
  }
}

void print(const char* policy, bool reset, const Soak& soak, double seconds) {
  std::printf(
      "{\"policy\": \"%s\", \"reset\": %s, \"held\": %llu, \"errors\": %llu, \"seconds\": %.1f, "
      "\"checkpoints\": [",
      policy, reset ? "true" : "false", static_cast<unsigned long long>(soak.held),
      static_cast<unsigned long long>(soak.errors), seconds);
  for (std::uint32_t i = 0; i < soak.checkpoints; ++i) {
    const Seen& seen = soak.seen[i];
    std::printf(
        "%s{\"held\": %llu, \"median_back\": %d, \"worst_back\": %d, \"moved\": %.3g, "
        "\"excitation\": %.3g, \"finite\": %s}",
        i == 0 ? "" : ", ", static_cast<unsigned long long>(kCheckpoints[i]),
        static_cast<int>(seen.median_back), static_cast<int>(seen.worst_back),
        static_cast<double>(seen.finite == 1 ? seen.moved : 0.0F),
        static_cast<double>(seen.excitation), seen.finite == 1 ? "true" : "false");
  }
  std::printf("]}\n");
}

/// Held samples until `end`, a checkpoint, or the deadline.
template <class Time>
void hold(Soak& soak, Estimator& estimator, std::uint64_t end, Time deadline) {
  constexpr std::uint64_t kBetweenLooks = 100'000;
  while (soak.held < end && std::chrono::steady_clock::now() < deadline) {
    const std::uint64_t stop = std::min(end, soak.held + kBetweenLooks);
    for (; soak.held < stop; ++soak.held) {
      soak.model.advance();
      soak.errors += ehsid_is_error(estimator.step(0.5, soak.model.position())) ? 1U : 0U;
      soak.model.command(0.5);
    }
  }
  soak.estimator = estimator.save();
}

}  // namespace

int main(int count, char** arguments) {
  if (count < 5 || count > 6) {
    fail("usage: soak_held POLICY reset|no_reset STATE_FILE SECONDS [UPDATES]");
  }
  const auto* policy =
      std::find_if(std::begin(kPolicies), std::end(kPolicies),
                   [&](const Policy& one) { return std::strcmp(one.name, arguments[1]) == 0; });
  if (policy == std::end(kPolicies)) {
    fail("no such policy");
  }
  const bool reset = std::strcmp(arguments[2], "reset") == 0;
  const double seconds = std::strtod(arguments[4], nullptr);
  const std::uint64_t most = count == 6
                                 ? static_cast<std::uint64_t>(std::strtod(arguments[5], nullptr))
                                 : kCheckpoints.back();
  const auto began = std::chrono::steady_clock::now();
  const auto deadline = began + std::chrono::duration_cast<std::chrono::steady_clock::duration>(
                                    std::chrono::duration<double>(seconds));

  Estimator estimator(policy->kernel, reset);
  Estimator copy(policy->kernel, reset);
  Soak soak;
  // The state of an older version is not taken over: the soak then begins anew.
  if (!read(arguments[3], soak) || !estimator.restore(soak.estimator)) {
    soak = Soak{};
    excite(soak, estimator);
    soak.estimator = estimator.save();
  }
  while (soak.checkpoints < kCheckpoints.size()) {
    const std::uint64_t next = std::min(kCheckpoints[soak.checkpoints], most);
    hold(soak, estimator, next, deadline);
    if (soak.held < kCheckpoints[soak.checkpoints]) {
      break;  // no more time, or as many as are wanted
    }
    soak.seen[soak.checkpoints] = look(soak, estimator, copy);
    ++soak.checkpoints;
  }
  write(arguments[3], soak);
  const std::chrono::duration<double> spent = std::chrono::steady_clock::now() - began;
  print(policy->name, reset, soak, spent.count());
  return 0;
}
