// SPDX-License-Identifier: MIT
// A servo at work in a closed loop, for benchmarks/growth_alarms.py. Reads from its standard input
//   seed samples dt substeps noise correlation oil slow, gain feed_forward limit, count of values, values,
//   count of cases, and for each: place of a value (-1: none), its growth
// correlation: of the sensor's noise from sample to sample. oil: share by which gain and viscous friction of a chunk may
// differ, with the place of the latter. slow: 1 for a work of slow, short moves.
//
// Without tables it writes command and position as float32. With them (EHSID_TABLES, a header of `ehsid export --growth`) it
// prints a line for each case: alarms for each of the limits, restarting at each; first alarm with its sample, size and
// deviation.
#include <ehsid/plant/servo_plant.hpp>

#ifdef EHSID_TABLES
#include EHSID_TABLES
#endif

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <iostream>
#include <limits>
#include <random>
#include <string>
#include <vector>

namespace {

using Plant = ehsid::plant::ServoPlant<double>;

struct Setting {
  std::uint64_t seed = 0;
  std::int64_t samples = 0;
  double dt = 0.0;
  int substeps = 0;
  double noise = 0.0;
  double correlation = 0.0;
  double oil = 0.0;
  std::size_t viscous = 0;
  int slow = 0;
  double gain = 0.0;
  double feed_forward = 0.0;
  double limit = 0.0;
  std::vector<double> values;
};

/// Moves between random places at random speeds, smooth, with rests between them.
class Work {
 public:
  Work(const Setting& setting, std::mt19937_64& random) : setting_(setting), random_(random) {}

  double next() {
    if (at_ >= move_ + rest_) {
      from_ = to_;
      const double half = setting_.slow ? 0.02 : 0.09;
      to_ = 0.15 + uniform(-half, half);
      const double speed = setting_.slow ? uniform(0.02, 0.1) : uniform(0.03, 0.3);
      move_ = std::max(2.0, std::floor(std::abs(to_ - from_) / speed / setting_.dt));
      rest_ = std::floor(uniform(0.05, 0.6) / setting_.dt);
      at_ = 0.0;
    }
    const double x = std::min(1.0, at_++ / move_);
    return from_ + (to_ - from_) * x * x * (3.0 - 2.0 * x);
  }

 private:
  double uniform(double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(random_);
  }

  const Setting& setting_;
  std::mt19937_64& random_;
  double from_ = 0.15;
  double to_ = 0.15;
  double at_ = 1e9;
  double move_ = 0.0;
  double rest_ = 0.0;
};

/// Hands every command and position to `take`, which returns whether to go on. A plant keeps its commands, so that a long
/// run is made in chunks; a hole is between them.
template <class Take>
void work(const Setting& setting, std::vector<double> values, Take take) {
  constexpr std::int64_t kChunk = 500000;
  std::mt19937_64 random(setting.seed);
  std::normal_distribution<double> normal;
  for (std::int64_t done = 0; done < setting.samples; done += kChunk) {
    const std::int64_t count = std::min(kChunk, setting.samples - done);
    std::vector<double> now = values;
    double share = 1.0;
    if (setting.oil > 0.0) {
      std::uniform_real_distribution<double> uniform(-1.0, 1.0);
      const double warm = uniform(random);
      share += 0.1 * setting.oil * warm;  // less viscous oil, a little more flow
      now[setting.viscous] *= 1.0 - setting.oil * warm;
    }
    Plant plant(ehsid::plant::PlantKind::ehs, now, setting.dt, setting.substeps,
                static_cast<std::size_t>(count) + 8);
    Work reference(setting, random);
    double before = reference.next();
    double error = 0.0;
    for (std::int64_t k = 0; k < count; ++k) {
      const double place = before;
      before = reference.next();
      error = setting.correlation * error +
              std::sqrt(1.0 - setting.correlation * setting.correlation) * normal(random);
      const double position = plant.read().position + setting.noise * error;
      const double wanted =
          setting.gain * (place - position) + setting.feed_forward * (before - place) / setting.dt;
      const double command = std::clamp(wanted, -setting.limit, setting.limit);
      plant.advance(share * command);
      if (!take(static_cast<float>(command), static_cast<float>(position), k == 0)) {
        return;
      }
    }
  }
}

}  // namespace

int main() {
  Setting s;
  std::size_t count = 0;
  std::cin >> s.seed >> s.samples >> s.dt >> s.substeps >> s.noise >> s.correlation >> s.oil >>
      s.viscous >> s.slow >> s.gain >> s.feed_forward >> s.limit >> count;
  s.values.resize(count);
  for (double& value : s.values) {
    std::string word;  // a stream reads no NaN
    std::cin >> word;
    value = std::stod(word);
  }
  int cases = 0;
  std::cin >> cases;
  for (int n = 0; n < cases; ++n) {
    int place = -1;
    double growth = 0.0;
    std::cin >> place >> growth;
    std::vector<double> values = s.values;
    if (place >= 0) {
      values[static_cast<std::size_t>(place)] += growth;
    }
#ifdef EHSID_TABLES
    // exp(limit) is the shortest mean distance of false alarms of a test, in blocks.
    constexpr double kBlocks[] = {2e2, 2e3, 2e4};
    constexpr int kMonitors = 3;
    const auto tests = servo::kGrowthTables.tests;
    std::array<servo::GrowthMonitor::Tables, kMonitors> tables;
    std::array<servo::GrowthMonitor, kMonitors + 1> monitors;
    std::array<std::array<long, 16>, kMonitors> alarms{};
    for (std::size_t i = 0; i < kMonitors; ++i) {
      tables[i] = servo::kGrowthTables;
      tables[i].limit = static_cast<float>(std::log(kBlocks[i] * tests));
      static_cast<void>(monitors[i].configure(tables[i]));
    }
    servo::GrowthMonitor& told = monitors[kMonitors];
    static_cast<void>(told.configure(servo::kGrowthTables));
    std::int64_t sample = 0;
    std::int64_t noticed = -1;
    std::int64_t named = -1;
    const bool quiet = place < 0;
    work(s, values, [&](float command, float position, bool first) {
      ++sample;
      for (std::size_t i = quiet ? 0 : kMonitors; i <= kMonitors; ++i) {
        if (first) {
          static_cast<void>(
              monitors[i].step(std::numeric_limits<float>::quiet_NaN(), 0.0F));  // a hole
        }
        static_cast<void>(monitors[i].step(command, position));
        if (i < kMonitors && monitors[i].first() >= 0) {
          ++alarms[i][static_cast<std::size_t>(monitors[i].first())];
          monitors[i].restart();
        }
      }
      if (noticed < 0 && told.first() >= 0) {
        noticed = sample;
      }
      if (named < 0 && told.named() >= 0) {
        named = sample;
      }
      // A run without a quiet machine ends five blocks behind the name.
      return quiet || named < 0 || sample < named + 5 * servo::kGrowthTables.block;
    });
    for (const auto& each : alarms) {
      for (int t = 0; t < tests; ++t) {
        std::printf("%ld ", each[static_cast<std::size_t>(t)]);
      }
    }
    const auto growing = told.told(std::max(0, static_cast<int>(told.named())));
    std::printf("%d %lld %d %lld %g %g\n", static_cast<int>(told.first()),
                static_cast<long long>(noticed), static_cast<int>(told.named()),
                static_cast<long long>(named), static_cast<double>(growing.size),
                static_cast<double>(growing.deviation));
    std::fflush(stdout);
#else
    work(s, values, [](float command, float position, bool) {
      const float both[2] = {command, position};
      return std::fwrite(both, sizeof both, 1, stdout) == 1;
    });
#endif
  }
  return 0;
}
