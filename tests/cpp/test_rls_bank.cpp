// SPDX-License-Identifier: MIT
// Every lane of a bank is the scalar recursion, bit for bit: sizes 1 and those chosen at run time, and regressors far out of
// range.
#include <ehsid/bank/rls_bank.hpp>

#include <gtest/gtest.h>

#include <random>
#include <set>
#include <vector>

namespace {

using ehsid::Status;
using ehsid::bank::Isa;

constexpr std::size_t kLanes = 21;
constexpr std::size_t kSamples = 1500;

template <class State>
std::vector<std::uint8_t> bytes_of(State state, int n) {
  const ehsid::ModelShape shape(n, 0, 0, false);
  std::vector<std::uint8_t> bytes(ehsid::field_bytes<State>(shape));
  ehsid::ByteStream writer = ehsid::ByteStream::writing(bytes.data());
  ehsid::stream_fields(writer, shape, state);
  return bytes;
}

template <class Scalar, int kN, class Forgetting>
std::set<Status> compare(Isa isa, int n) {
  using One = ehsid::Rls<Scalar, kN, Forgetting>;
  using Vector = typename One::Parameters;
  std::vector<One> alone;
  for (std::size_t lane = 0; lane < kLanes; ++lane) {
    alone.emplace_back();
    const auto variance = static_cast<Scalar>(lane % 3 == 2 ? 1e2 : 1e6);
    EXPECT_EQ(alone.back().start(Vector::Zero(n), Vector::Constant(n, variance)), Status::ok);
  }
  ehsid::RlsBank<Scalar, kN, Forgetting> bank(kLanes, alone.front(), isa);
  for (std::size_t lane = 0; lane < kLanes; ++lane) {
    bank.set(lane, alone[lane]);
  }
  std::mt19937 random(7);
  std::normal_distribution<double> normal;
  std::vector<Scalar> phi(static_cast<std::size_t>(n) * kLanes);
  std::vector<Scalar> y(kLanes);
  std::vector<std::uint8_t> status(kLanes);
  std::set<Status> seen;
  for (std::size_t k = 0; k < kSamples; ++k) {
    for (std::size_t lane = 0; lane < kLanes; ++lane) {
      // From time to time a regressor that is zero, is huge, or hides in the last digits; for long times a held one.
      const std::size_t kind = (k * 31 + lane * 17) % 211;
      const double size = kind == 0 ? 0.0 : kind == 1 ? 1e18 : kind == 2 ? 1e-30 : 1.0;
      const bool held = k > 300 + 10 * lane && k < 900;
      double sum = 1e-3 * normal(random);
      for (int i = 0; i < n; ++i) {
        const double entry = size * (held ? 0.4 : normal(random));
        phi[static_cast<std::size_t>(i) * kLanes + lane] = static_cast<Scalar>(entry);
        sum += (k > 1200 ? 2.0 : 1.0) * entry / (i + 1);
      }
      y[lane] = static_cast<Scalar>(kind == 3 ? 1e19 : sum);
      if (kind == 4) {
        y[lane] = std::numeric_limits<Scalar>::quiet_NaN();
      }
    }
    bank.update(phi.data(), y.data(), status.data());
    for (std::size_t lane = 0; lane < kLanes; ++lane) {
      Vector regressor(n);
      for (int i = 0; i < n; ++i) {
        regressor[i] = phi[static_cast<std::size_t>(i) * kLanes + lane];
      }
      const Status own = alone[lane].update(regressor, y[lane]);
      seen.insert(own);
      EXPECT_EQ(static_cast<Status>(status[lane]), own) << lane << " at " << k;
      One copy = alone[lane];
      copy.reset_all();
      bank.get(lane, copy);
      EXPECT_EQ(bytes_of(copy.state(), n), bytes_of(alone[lane].state(), n)) << lane << " at " << k;
      if (testing::Test::HasFailure()) {
        return seen;
      }
    }
  }
  return seen;
}

template <class Scalar, int kN, class Forgetting>
void compare_all(int n) {
  for (const Isa isa : {Isa::baseline, Isa::avx2, Isa::avx512}) {
    if (ehsid::bank::supported(isa)) {
      SCOPED_TRACE(static_cast<int>(isa));
      const auto seen = compare<Scalar, kN, Forgetting>(isa, n);
      for (const Status needed : {Status::ok, Status::no_information, Status::invalid_input}) {
        EXPECT_EQ(seen.count(needed), 1U) << static_cast<int>(needed);
      }
    }
  }
}

TEST(RlsBank, EqualsTheScalarRecursionOfASizeChosenAtRunTime) {
  compare_all<float, ehsid::up_to(5), ehsid::ErrorDriven<float>>(4);
}
TEST(RlsBank, EqualsTheScalarRecursionOfOneParameter) {
  compare_all<float, 1, ehsid::Constant<float>>(1);
}
#if !defined(EHSID_FEWER)  // each takes a quarter of a minute to compile
TEST(RlsBank, EqualsTheScalarRecursionOfTwelve) {
  compare_all<float, 12, ehsid::Exponential<float>>(12);
}
TEST(RlsBank, EqualsTheScalarRecursionInDouble) {
  compare_all<double, 4, ehsid::Constant<double>>(4);
}
#endif

}  // namespace
