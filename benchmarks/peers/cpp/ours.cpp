// SPDX-License-Identifier: MIT
// The recursion with each forgetting policy, and the whole estimator as a controller calls it, for EHSID_N parameters.
#include <ehsid/ehsid.hpp>

#include <algorithm>
#include <string>

#include "families.hpp"

namespace {

using peers::Prior;
using peers::Sample;
using peers::Settings;

constexpr int kN = EHSID_N;

/// Constant takes the forgetting factor; the other policies keep their defaults.
template <class Policy>
Policy policy_with(double lambda) {
  Policy policy;
  if constexpr (Policy::kId == ehsid::Constant<float>::kId) {
    policy.lambda = static_cast<decltype(policy.lambda)>(lambda);
  }
  return policy;
}

template <class Scalar, class Policy, class Parts = ehsid::AllParts>
struct Recursion {
  static constexpr bool kMakesRegressor = false;
  using Rls = ehsid::Rls<Scalar, kN, Policy, Parts>;
  struct Input {
    typename Rls::Regressor phi;
    Scalar y;
  };

  static Input input(const Sample& sample) {
    Input converted;
    for (int i = 0; i < kN; ++i) {
      converted.phi[i] = static_cast<Scalar>(sample.phi[i]);
    }
    converted.y = static_cast<Scalar>(sample.y);
    return converted;
  }
  Prior start(const Settings& settings) {
    rls_ = Rls{policy_with<Policy>(settings.lambda)};
    const auto variance = static_cast<Scalar>(settings.variance0);
    static_cast<void>(rls_.start(Rls::Parameters::Zero(), Rls::Parameters::Constant(variance)));
    return {settings.variance0, false};
  }
  void update(const Input& input) { static_cast<void>(rls_.update(input.phi, input.y)); }
  void theta(double* to) const {
    const typename Rls::Parameters found = rls_.theta_hat();
    std::copy(found.data(), found.data() + kN, to);
  }

 private:
  Rls rls_;
};

/// Makes its regressor itself, with kNa past positions and kNb past commands, and keeps a reset and two monitors.
template <class Scalar, class Policy, class Parts = ehsid::AllParts>
struct Whole {
  static constexpr bool kMakesRegressor = true;
  static constexpr int kNa = kN / 2;
  using Estimator = ehsid::SmallArxEstimator<Scalar, kNa, kN - kNa, 1, Policy, Parts>;
  struct Input {
    Scalar command;
    Scalar position;
  };

  static Input input(const Sample& sample) {
    return {static_cast<Scalar>(sample.u), static_cast<Scalar>(sample.y)};
  }
  Prior start(const Settings& settings) {
    typename Estimator::Options options;
    options.forgetting = policy_with<Policy>(settings.lambda);
    options.variance0 = Estimator::Parameters::Constant(static_cast<Scalar>(settings.variance0));
    static_cast<void>(estimator_.configure(options));
    return {settings.variance0, false};
  }
  void update(const Input& input) {
    static_cast<void>(estimator_.step(input.command, input.position));
  }
  void theta(double* to) const {
    const typename Estimator::Parameters found = estimator_.theta_hat();
    std::copy(found.data(), found.data() + kN, to);
  }

 private:
  Estimator estimator_;
};

template <class Scalar>
void add_both(peers::Entries& entries) {
  const char* scalar = peers::name_of<Scalar>();
  ehsid::for_each_policy([&](auto place) {
    using Policy = ehsid::PolicyAt<place, Scalar>;
    const std::string name = std::string("Rls, ") + Policy::kInfo.type;
    peers::add<Recursion<Scalar, Policy>>(entries, name.c_str(), scalar, true);
  });
  using Constant = ehsid::Constant<Scalar>;
  peers::add<Recursion<Scalar, Constant, ehsid::NoParts>>(entries, "Rls, Constant, no parts",
                                                          scalar, true);
  peers::add<Whole<Scalar, Constant, ehsid::NoParts>>(entries, "SmallArxEstimator::step", scalar,
                                                      true);
  peers::add<Whole<Scalar, Constant>>(entries, "ArxEstimator::step, Constant", scalar, true);
  peers::add<Whole<Scalar, ehsid::FRatio<Scalar>>>(entries, "ArxEstimator::step, FRatio", scalar,
                                                   true);
}

}  // namespace

namespace peers {

template <>
void add_ours<kN>(Entries& entries) {
  add_both<float>(entries);
  add_both<double>(entries);
}

}  // namespace peers
