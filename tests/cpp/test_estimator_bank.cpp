// SPDX-License-Identifier: MIT
// Every lane of a bank is the scalar estimator, bit for bit, whatever the lanes beside it do.
#include "bank_signals.hpp"

#include <ehsid/bank/estimator_bank.hpp>

#include <gtest/gtest.h>

#include <memory>
#include <set>
#include <vector>

namespace {

using ehsid::Status;
using ehsid::bank::Isa;

constexpr std::size_t kLanes = 37;  // the last tile is not full, with any instructions
constexpr std::size_t kSamples = 1800;

std::vector<Isa> machine() {
  std::vector<Isa> all;
  for (const Isa isa : {Isa::baseline, Isa::avx2, Isa::avx512}) {
    if (ehsid::bank::supported(isa)) {
      all.push_back(isa);
    }
  }
  return all;
}

template <class Estimator>
Estimator make(std::size_t lane) {
  using Scalar = typename Estimator::Scalar;
  typename Estimator::Options options;
  const auto part = static_cast<Scalar>(lane % 5);
  options.scaling = {Scalar(1) + part, Scalar(0.5) + part, Scalar(0.1) * part, Scalar(-0.2)};
  options.reset_enabled = lane % 4 != 3;
  options.reset.cool_down = static_cast<int>(20 + lane);
  options.convergence.tolerance = Scalar(0.01) * (part + Scalar(1));
  options.variance0.setConstant(lane % 6 == 5 ? Scalar(10) : Scalar(1e6));
  options.theta0.setConstant(Scalar(0.01) * part);
  if (lane % 8 == 6) {
    options.rls = ehsid::RlsOptions<Scalar>::textbook();
  } else if (lane % 8 == 7) {
    options.rls.information_margin = Scalar(3);
    options.rls.covariance_ceiling = Scalar(0.01);
  }
  options.input_limit = lane % 2 == 0 ? Scalar(1e4) : Scalar(50);
  Estimator one;
  EXPECT_EQ(one.configure(options), Status::ok);
  return one;
}

/// Compares states after every block of samples, and the status of each sample. Returns every status that was seen.
template <class Estimator>
std::set<Status> compare(Isa isa, unsigned seed) {
  using Scalar = typename Estimator::Scalar;
  const auto record = test::bank_record<Scalar>(kSamples, kLanes, seed);
  std::vector<Estimator> alone;
  ehsid::OnlineEstimatorBank<Estimator> bank(kLanes, Estimator{}, isa);
  EXPECT_EQ(bank.isa(), isa);
  for (std::size_t lane = 0; lane < kLanes; ++lane) {
    alone.push_back(make<Estimator>(lane));
    alone.back().enable(lane != 11);
    bank.set(lane, alone.back());
  }
  std::set<Status> seen;
  constexpr std::size_t kBlock = 60;
  std::vector<std::uint8_t> status(kBlock * kLanes);
  for (std::size_t start = 0; start < kSamples; start += kBlock) {
    bank.run({&record.commands[start * kLanes], kLanes, 1},
             {&record.positions[start * kLanes], kLanes, 1}, kBlock, status.data());
    for (std::size_t lane = 0; lane < kLanes; ++lane) {
      for (std::size_t k = 0; k < kBlock; ++k) {
        const std::size_t at = (start + k) * kLanes + lane;
        const Status own = alone[lane].step(record.commands[at], record.positions[at]);
        seen.insert(own);
        EXPECT_EQ(static_cast<Status>(status[k * kLanes + lane]), own)
            << lane << " at " << start + k;
      }
      Estimator copy = make<Estimator>(lane);
      bank.get(lane, copy);
      EXPECT_EQ(copy.save(), alone[lane].save()) << "lane " << lane << " before " << start + kBlock;
      if (testing::Test::HasFailure()) {
        return seen;
      }
    }
  }
  return seen;
}

template <class Estimator>
void compare_all() {
  for (const Isa isa : machine()) {
    SCOPED_TRACE(static_cast<int>(isa));
    const auto seen = compare<Estimator>(isa, 1);
    for (const Status needed :
         {Status::ok, Status::filling, Status::no_information, Status::disabled, Status::reset,
          Status::invalid_input, Status::out_of_range}) {
      EXPECT_EQ(seen.count(needed), 1U) << static_cast<int>(needed);
    }
  }
}

using namespace ehsid;  // NOLINT: the names of the policies

// Of the policies, those whose lanes differ most: each takes ten seconds to compile, and the tests of the Python module run
// all of them with both precisions. With sanitizers, which take twice as long, one must do.
TEST(EstimatorBank, EqualsTheScalarEstimatorErrorDriven) {
  compare_all<ArxEstimator<float, 3, 3, 1, ErrorDriven<float>>>();
}
#if !defined(EHSID_FEWER)
TEST(EstimatorBank, EqualsTheScalarEstimatorFRatioInDouble) {
  compare_all<ArxEstimator<double, 3, 3, 1, FRatio<double>>>();
}
TEST(EstimatorBank, EqualsTheScalarEstimatorExponentialWithOffset) {
  compare_all<ArxEstimator<float, 2, 1, 2, Exponential<float>, true>>();
}
#endif

TEST(EstimatorBank, ReportsWhatTheScalarEstimatorReports) {
  using Estimator = ArxEstimator<float, 3, 3, 1, ErrorDriven<float>>;
  const auto record = test::bank_record<float>(kSamples, kLanes, 2);
  constexpr std::size_t kEvery = 7;
  constexpr std::size_t kRows = kSamples / kEvery;
  for (const Isa isa : machine()) {
    OnlineEstimatorBank<Estimator> bank(kLanes, make<Estimator>(0), isa);
    std::vector<float> theta(kRows * kLanes * 6);
    std::vector<float> deviation(theta.size());
    std::vector<float> innovation(kRows * kLanes);
    std::vector<float> factor(innovation.size());
    std::vector<float> variance(innovation.size());
    const std::unique_ptr<bool[]> converged(new bool[innovation.size()]);
    std::vector<std::uint8_t> statuses(innovation.size());
    bank.run({record.commands.data(), kLanes, 1}, {record.positions.data(), kLanes, 1}, kSamples,
             nullptr,
             {theta.data(), deviation.data(), innovation.data(), factor.data(), variance.data(),
              converged.get(), statuses.data(), kEvery});
    for (std::size_t lane = 0; lane < kLanes; ++lane) {
      Estimator alone = make<Estimator>(0);
      for (std::size_t k = 0; k < kRows * kEvery; ++k) {
        const std::size_t at = k * kLanes + lane;
        const Status now = alone.step(record.commands[at], record.positions[at]);
        if ((k + 1) % kEvery == 0) {
          const std::size_t place = k / kEvery * kLanes + lane;
          for (int i = 0; i < 6; ++i) {
            const std::size_t entry = place * 6 + static_cast<std::size_t>(i);
            ASSERT_EQ(bits_of(theta[entry]), bits_of(alone.theta_hat()[i])) << lane << " " << k;
            ASSERT_EQ(bits_of(deviation[entry]), bits_of(alone.standard_deviation()[i]));
          }
          if (now == Status::ok || now == Status::reset || now == Status::no_information) {
            ASSERT_EQ(bits_of(innovation[place]), bits_of(alone.innovation()));
          } else {
            ASSERT_FALSE(is_finite(innovation[place]));
          }
          ASSERT_EQ(bits_of(factor[place]), bits_of(alone.forgetting_factor()));
          ASSERT_EQ(bits_of(variance[place]), bits_of(alone.residual_variance()));
          ASSERT_EQ(converged[place], alone.converged());
          ASSERT_EQ(static_cast<Status>(statuses[place]), now);
        }
      }
    }
  }
}

TEST(EstimatorBank, OneRecordServesAllLanes) {
  using Estimator = ArxEstimator<float, 3, 3, 1, ErrorDriven<float>>;
  const auto record = test::bank_record<float>(400, 1, 3);
  OnlineEstimatorBank<Estimator> bank(kLanes, make<Estimator>(1));
  std::vector<std::uint8_t> status(400 * kLanes);
  bank.run({record.commands.data(), 1, 0}, {record.positions.data(), 1, 0}, 400, status.data());
  Estimator alone = make<Estimator>(1);
  for (std::size_t k = 0; k < 400; ++k) {
    static_cast<void>(alone.step(record.commands[k], record.positions[k]));
  }
  for (std::size_t lane = 0; lane < kLanes; ++lane) {
    Estimator copy = make<Estimator>(1);
    bank.get(lane, copy);
    EXPECT_EQ(copy.save(), alone.save()) << lane;
  }
}

}  // namespace
