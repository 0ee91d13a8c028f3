// SPDX-License-Identifier: MIT
// Time of an update in a bank, each set of instructions that this machine has, against the scalar update of the same process:
//   g++ -std=c++17 -O2 -DNDEBUG -ffp-contract=off -fno-math-errno -Wno-psabi -I cpp/include -isystem /usr/include/eigen3
//     benchmarks/bank_speed.cpp -o bank_speed
// Nanoseconds an update of one estimator, n = 6, the best of 200 passes over 256 samples. "held": the same regressor for ever,
// so that every sample is left out for lack of information. The second table: a whole step of estimators ARX(3, 3, 1).
#include <ehsid/bank/estimator_bank.hpp>
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

// best of the passes of `many`, for each set of instructions, then that of the scalar code between them.
template <class Many, class Alone>
void compare(const Many& many, const Alone& alone) {
  double scalar_best = 1e9;
  for (const auto isa :
       {ehsid::bank::Isa::baseline, ehsid::bank::Isa::avx2, ehsid::bank::Isa::avx512}) {
    if (!ehsid::bank::supported(isa)) {
      continue;
    }
    auto run = many(isa);
    double best = 1e9;
    for (int pass = 0; pass < kPasses; ++pass) {
      best = std::min(best, nanoseconds([&] { run(pass); }));
      if (pass % 10 == 0) {
        scalar_best = std::min(scalar_best, nanoseconds([&] { alone(pass); }));
      }
    }
    std::printf(" %8.1f", best);
  }
  std::printf(" %8.1f\n", scalar_best);
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
  // The scalar code reads the samples of one estimator after the other.
  std::vector<typename One::Regressor> regressors(kSamples * kLanes);
  std::vector<Scalar> measured(kSamples * kLanes);
  for (std::size_t lane = 0; lane < kLanes; ++lane) {
    for (std::size_t k = 0; k < kSamples; ++k) {
      for (std::size_t i = 0; i < kN; ++i) {
        regressors[lane * kSamples + k][static_cast<int>(i)] = phi[(k * kN + i) * kLanes + lane];
      }
      measured[lane * kSamples + k] = y[k * kLanes + lane];
    }
  }
  std::vector<std::uint8_t> status(kSamples * kLanes);
  std::vector<One> alone(kLanes);
  std::printf("%-7s %-12s %-8s", scalar, Forgetting::kInfo.type, held ? "held" : "excited");
  compare(
      [&](ehsid::bank::Isa isa) {
        return
            [&, bank = ehsid::RlsBank<Scalar, kN, Forgetting>(kLanes, One{}, isa)](
                int /*pass*/) mutable { bank.run(phi.data(), y.data(), kSamples, status.data()); };
      },
      [&](int /*pass*/) {
        for (std::size_t lane = 0; lane < kLanes; ++lane) {
          for (std::size_t k = lane * kSamples; k < (lane + 1) * kSamples; ++k) {
            static_cast<void>(alone[lane].update(regressors[k], measured[k]));
          }
        }
      });
}

// A record that goes on: the estimators would take its beginning anew for a change of the plant.
template <class Scalar, class Forgetting>
void measure_steps(const char* scalar) {
  using One = ehsid::ArxEstimator<Scalar, 3, 3, 1, Forgetting>;
  constexpr std::size_t kRecord = 20 * kSamples;
  std::mt19937 random(2);
  std::normal_distribution<double> normal;
  std::vector<Scalar> u(kRecord * kLanes);
  std::vector<Scalar> y(kRecord * kLanes);
  std::vector<Scalar> own_u(kRecord * kLanes);
  std::vector<Scalar> own_y(kRecord * kLanes);
  for (std::size_t lane = 0; lane < kLanes; ++lane) {
    double past[4] = {};
    double command = 0.0;
    for (std::size_t k = 0; k < kRecord; ++k) {
      past[0] =
          1.8 * past[1] - 1.1 * past[2] + 0.25 * past[3] + 0.1 * command + 1e-3 * normal(random);
      command = normal(random);
      std::copy_backward(past, past + 3, past + 4);
      u[k * kLanes + lane] = own_u[lane * kRecord + k] = static_cast<Scalar>(command);
      y[k * kLanes + lane] = own_y[lane * kRecord + k] = static_cast<Scalar>(past[0]);
    }
  }
  std::vector<One> alone(kLanes);
  const auto part = [](int pass) { return static_cast<std::size_t>(pass % 20) * kSamples; };
  std::printf("%-7s %-12s %-8s", scalar, Forgetting::kInfo.type, "step");
  compare(
      [&](ehsid::bank::Isa isa) {
        return [&, bank = ehsid::OnlineEstimatorBank<One>(kLanes, One{}, isa)](int pass) mutable {
          bank.run({u.data() + part(pass) * kLanes, kLanes, 1},
                   {y.data() + part(pass) * kLanes, kLanes, 1}, kSamples, nullptr);
        };
      },
      [&](int pass) {
        for (std::size_t lane = 0; lane < kLanes; ++lane) {
          const std::size_t first = lane * kRecord + part(pass / 10);
          for (std::size_t k = first; k < first + kSamples; ++k) {
            static_cast<void>(alone[lane].step(own_u[k], own_y[k]));
          }
        }
      });
}

}  // namespace

int main() {
  std::printf("%-29s %8s %8s %8s %8s  (columns of missing instructions are left out)\n", "",
              "baseline", "avx2", "avx512", "scalar");
  for (const bool held : {false, true}) {
    ehsid::for_each_policy([&](auto place) {
      measure<float, ehsid::PolicyAt<place, float>>("float", held);
      measure<double, ehsid::PolicyAt<place, double>>("double", held);
    });
  }
  ehsid::for_each_policy([&](auto place) {
    measure_steps<float, ehsid::PolicyAt<place, float>>("float");
    measure_steps<double, ehsid::PolicyAt<place, double>>("double");
  });
}
