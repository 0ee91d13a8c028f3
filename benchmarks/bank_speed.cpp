// SPDX-License-Identifier: MIT
// Time of an update in a bank, each set of instructions that this machine has, against the scalar update of the same process:
//   g++ -std=c++17 -O2 -DNDEBUG -ffp-contract=off -fno-math-errno -Wno-psabi -I cpp/include -isystem /usr/include/eigen3
//     benchmarks/bank_speed.cpp -o bank_speed
// Nanoseconds an update of one estimator, n = 6, the best of 200 passes over 256 samples. "held": the same regressor for ever,
// so that every sample is left out for lack of information.
#include <ehsid/bank/rls_bank.hpp>

#include <algorithm>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <random>
#include <vector>

namespace {

constexpr int kN = 6;
constexpr std::size_t kLanes = 64;
constexpr std::size_t kSamples = 256;
constexpr int kPasses = 200;

template <class Call>
double nanoseconds(const Call& call) {
  const auto start = std::chrono::steady_clock::now();
  call();
  const std::chrono::duration<double, std::nano> time = std::chrono::steady_clock::now() - start;
  return time.count() / static_cast<double>(kSamples * kLanes);
}

template <class Scalar, class Forgetting>
void measure(const char* scalar, bool held) {
  using One = ehsid::Rls<Scalar, kN, Forgetting>;
  std::mt19937 random(1);
  std::normal_distribution<double> normal;
  std::vector<Scalar> phi(kSamples * kN * kLanes);
  std::vector<Scalar> y(kSamples * kLanes);
  for (std::size_t k = 0; k < kSamples; ++k) {
    for (std::size_t lane = 0; lane < kLanes; ++lane) {
      double sum = 1e-3 * normal(random);
      for (std::size_t i = 0; i < kN; ++i) {
        const double entry = held ? 0.5 : normal(random);
        phi[(k * kN + i) * kLanes + lane] = static_cast<Scalar>(entry);
        sum += entry / static_cast<double>(i + 1);
      }
      y[k * kLanes + lane] = static_cast<Scalar>(sum);
    }
  }
  std::vector<std::uint8_t> status(kSamples * kLanes);
  std::printf("%-7s %-12s %-8s", scalar, Forgetting::kInfo.type, held ? "held" : "excited");
  std::vector<One> alone(kLanes);
  double scalar_best = 1e9;
  for (const auto isa :
       {ehsid::bank::Isa::baseline, ehsid::bank::Isa::avx2, ehsid::bank::Isa::avx512}) {
    if (!ehsid::bank::supported(isa)) {
      continue;
    }
    ehsid::RlsBank<Scalar, kN, Forgetting> bank(kLanes, One{}, isa);
    double best = 1e9;
    for (int pass = 0; pass < kPasses; ++pass) {
      best = std::min(
          best, nanoseconds([&] { bank.run(phi.data(), y.data(), kSamples, status.data()); }));
      if (pass % 20 == 0) {
        scalar_best =
            std::min(scalar_best, nanoseconds([&] {
                       for (std::size_t lane = 0; lane < kLanes; ++lane) {
                         for (std::size_t k = 0; k < kSamples; ++k) {
                           typename One::Regressor regressor;
                           for (std::size_t i = 0; i < kN; ++i) {
                             regressor[static_cast<int>(i)] = phi[(k * kN + i) * kLanes + lane];
                           }
                           static_cast<void>(alone[lane].update(regressor, y[k * kLanes + lane]));
                         }
                       }
                     }));
      }
    }
    std::printf(" %8.1f", best);
  }
  std::printf(" %8.1f\n", scalar_best);
}

}  // namespace

int main() {
  std::printf("%-29s %8s %8s %8s %8s  (columns of missing instructions are left out)\n", "",
              "baseline", "avx2", "avx512", "scalar");
  for (const bool held : {false, true}) {
    ehsid::for_each_policy([&](auto place) {
      measure<float, ehsid::PolicyAt<place, float, kN>>("float", held);
      measure<double, ehsid::PolicyAt<place, double, kN>>("double", held);
    });
  }
}
