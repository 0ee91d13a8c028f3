// SPDX-License-Identifier: MIT
// The banks behind any_estimator.hpp: one for each policy for any number of parameters, and one for the third-order servo
// model, whose kernel has all loops unrolled.
#pragma once

#include "estimator_instances.hpp"

#include <ehsid/bank/estimator_bank.hpp>

#include <thread>

namespace ehsid::bindings {

inline constexpr const char* kInstructions[] = {"baseline", "avx2", "avx512"};

inline bank::Isa to_isa(const std::string& name) {
  if (name.empty()) {
    return bank::best_isa();
  }
  for (const bank::Isa isa : {bank::Isa::baseline, bank::Isa::avx2, bank::Isa::avx512}) {
    if (name == kInstructions[static_cast<int>(isa)]) {
      if (!bank::supported(isa)) {
        throw std::invalid_argument("instructions: this machine does not have '" + name +
                                    "'; leave the argument away to take the best it has");
      }
      return isa;
    }
  }
  throw std::invalid_argument("instructions is '" + name +
                              "'; expected one of 'baseline', 'avx2' and 'avx512'");
}

/// Pattern: the type of estimator that the kernel is made for. The estimators copied in and out are those of Instance.
template <class Instance, class Pattern>
class BankInstance final : public AnyBank {
 public:
  using Scalar = typename Pattern::Scalar;
  using Bank = OnlineEstimatorBank<Pattern>;

  BankInstance(const std::vector<AnyEstimator*>& estimators, bank::Isa isa)
      : bank_(estimators.size(), dynamic_cast<Instance&>(*estimators.front()).estimator(), isa) {
    for (std::size_t i = 0; i < estimators.size(); ++i) {
      auto* one = dynamic_cast<Instance*>(estimators[i]);
      if (one == nullptr || !(one->orders() == estimators.front()->orders())) {
        throw std::invalid_argument(
            "estimators[" + std::to_string(i) +
            "] is not like estimators[0]; expected the same na, nb, nk, offset, dtype, method and "
            "kind of forgetting policy (its numbers may differ): make a bank for each kind");
      }
      bank_.set(i, one->estimator());
    }
  }

  std::size_t size() const override { return bank_.size(); }
  const char* instructions() const override { return kInstructions[static_cast<int>(bank_.isa())]; }
  void get(std::size_t index, AnyEstimator& one) const override {
    bank_.get(index, dynamic_cast<Instance&>(one).estimator());
  }
  void set(std::size_t index, AnyEstimator& one) override {
    bank_.set(index, dynamic_cast<Instance&>(one).estimator());
  }
  void run(BankColumn<float> u, BankColumn<float> y, std::size_t samples, unsigned threads,
           BankView<float> to) override {
    run_in(u, y, samples, threads, to);
  }
  void run(BankColumn<double> u, BankColumn<double> y, std::size_t samples, unsigned threads,
           BankView<double> to) override {
    run_in(u, y, samples, threads, to);
  }

 private:
  template <class Number>
  void run_in(BankColumn<Number> u, BankColumn<Number> y, std::size_t samples, unsigned threads,
              const BankView<Number>& view) {
    if constexpr (std::is_same_v<Number, Scalar>) {
      const std::size_t count = size();
      const auto table = [&](const BankColumn<Scalar>& column) {
        return bank::Table<Scalar>{column.numbers, column.shared ? 1 : count,
                                   column.shared ? std::size_t{0} : std::size_t{1}};
      };
      BankTrajectory<Scalar> to;
      if (view.every > 0) {
        to = {view.to.theta,
              view.to.deviation,
              view.to.innovation,
              view.to.forgetting_factor,
              view.to.residual_variance,
              view.to.converged,
              view.to.status,
              view.every};
      }
      // Shares in multiples of 64 estimators, which no two threads write in one line of the cache.
      constexpr std::size_t kGrain = 64;
      const std::size_t grains = (count + kGrain - 1) / kGrain;
      const std::size_t workers = std::min(static_cast<std::size_t>(threads), grains);
      const auto work = [&](std::size_t worker) {
        const std::size_t first = grains * worker / workers * kGrain;
        const std::size_t last = grains * (worker + 1) / workers * kGrain;
        bank_.run(table(u), table(y), samples, nullptr, to, first, last);
      };
      std::vector<std::thread> others;
      for (std::size_t worker = 1; worker < workers; ++worker) {
        others.emplace_back(work, worker);
      }
      work(0);
      for (std::thread& other : others) {
        other.join();
      }
    }
  }

  mutable Bank bank_;
};

/// The bank of the estimators' policy, Pattern<kPlace> the estimator with this policy that the kernel is made for. Null where
/// the estimators run another method than rls.
template <class Scalar, template <std::size_t> class Pattern>
std::unique_ptr<AnyBank> make_bank_of(const std::vector<AnyEstimator*>& estimators, bank::Isa isa) {
  std::unique_ptr<AnyBank> made;
  for_each_policy([&](auto place) {
    using Instance = EstimatorInstance<Scalar, PolicyAt<place, Scalar>>;
    if (dynamic_cast<Instance*>(estimators.front()) != nullptr) {
      made =
          std::make_unique<BankInstance<Instance, typename Pattern<place>::Type>>(estimators, isa);
    }
  });
  return made;
}

/// A bank of estimators ARX(3, 3, 1) without offset in float32: see bank_servo.cpp.
std::unique_ptr<AnyBank> make_third_order_bank(const std::vector<AnyEstimator*>& estimators,
                                               bank::Isa isa);

template <class Scalar>
struct ForAnyOrders {
  template <std::size_t kPlace>
  struct Pattern {
    using Type = typename EstimatorInstance<Scalar, PolicyAt<kPlace, Scalar>>::Estimator;
  };
};

template <class Scalar>
std::unique_ptr<AnyBank> make_bank(const std::vector<AnyEstimator*>& estimators,
                                   const std::string& instructions) {
  const bank::Isa isa = to_isa(instructions);
  const bool servo =
      estimators.front()->single() && estimators.front()->orders() == ModelShape(3, 3, 1, false);
  auto made = servo ? make_third_order_bank(estimators, isa)
                    : make_bank_of<Scalar, ForAnyOrders<Scalar>::template Pattern>(estimators, isa);
  if (made == nullptr) {
    throw std::invalid_argument("a bank runs estimators with method='rls' only");
  }
  return made;
}

}  // namespace ehsid::bindings
