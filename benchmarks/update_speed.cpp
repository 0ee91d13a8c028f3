// SPDX-License-Identifier: MIT
// Time of an update on this machine, every policy, float and double:
//   g++ -std=c++17 -O2 -DNDEBUG -I cpp/include -isystem /usr/include/eigen3 benchmarks/update_speed.cpp -o update_speed
// Nanoseconds, the best of 25 passes over 40960 samples that carry information.
#include <ehsid/ehsid.hpp>

#include <algorithm>
#include <array>
#include <chrono>
#include <cstddef>
#include <cstdio>
#include <random>

namespace {

constexpr std::size_t kSamples = 1024;
constexpr int kRepeats = 40;
constexpr int kPasses = 25;

template <class Recursion>
double nanoseconds() {
  using Scalar = typename Recursion::Scalar;
  std::mt19937 random(1);
  std::normal_distribution<double> normal;
  std::array<typename Recursion::Regressor, kSamples> phi;
  std::array<Scalar, kSamples> y;
  for (std::size_t k = 0; k < kSamples; ++k) {
    y[k] = static_cast<Scalar>(1e-3 * normal(random));
    for (int i = 0; i < Recursion::kN; ++i) {
      phi[k][i] = static_cast<Scalar>(normal(random));
      y[k] += phi[k][i] / static_cast<Scalar>(i + 1);
    }
  }
  double best = 1e9;
  for (int pass = 0; pass < kPasses; ++pass) {
    Recursion rls;
    bool good = true;
    const auto start = std::chrono::steady_clock::now();
    for (int repeat = 0; repeat < kRepeats; ++repeat) {
      for (std::size_t k = 0; k < kSamples; ++k) {
        good = !ehsid::is_error(rls.update(phi[k], y[k])) && good;
      }
    }
    const std::chrono::duration<double, std::nano> time = std::chrono::steady_clock::now() - start;
    best = good ? std::min(best, time.count() / (kRepeats * kSamples)) : best;
  }
  return best;
}

template <class Scalar, int kN>
void print(const char* scalar) {
  std::printf("%-6s %2d", scalar, kN);
  ehsid::for_each_policy([](auto place) {
    using Policy = ehsid::PolicyAt<place, Scalar, kN>;
    std::printf(" %12.0f", nanoseconds<ehsid::Rls<Scalar, kN, Policy>>());
  });
  std::printf("\n");
}

}  // namespace

int main() {
  std::printf("%-6s %2s", "", "n");
  ehsid::for_each_policy(
      [](auto place) { std::printf(" %12s", ehsid::PolicyAt<place, float, 1>::kInfo.type); });
  std::printf("\n");
  print<float, 4>("float");
  print<float, 6>("float");
  print<float, 10>("float");
  print<double, 4>("double");
  print<double, 6>("double");
  print<double, 10>("double");
}
