// SPDX-License-Identifier: MIT
#pragma once

#include <ehsid/forgetting/evidence.hpp>
#include <ehsid/forgetting/settings.hpp>
#include <ehsid/ud.hpp>

namespace ehsid {

/// Directional forgetting (SIFt): forgets only along the regressor of the moment, so directions that
/// are not excited keep what they know.
///
/// Source: B. Lai, D. S. Bernstein, "SIFt-RLS: subspace of information forgetting recursive least
/// squares", arXiv 2404.10844; here for a scalar output.
/// Equation, with R = P^-1: R <- R - (1 - lambda) R phi phi' R / (phi' R phi), that is
///   P <- P + (1 - lambda) / (lambda phi' R phi) phi phi',   then the measurement update with lambda = 1.
/// Where ||phi||^2 < epsilon the sample is filtered out, as in the paper.
/// Guarantee: upper and lower bound of P without persistent excitation (the paper's theorem).
/// Cost: a triangular solve and a rank-one update, about 2 n^2 multiplications more; n + 1 more divisions.
/// Default: lambda = 0.94 (the memory looks like n / (1 - lambda): 100 samples at n = 6); epsilon = 1e-4, a
/// regressor of 1 % of full scale once inputs are scaled.
template <class Scalar>
struct Directional {
  static constexpr std::uint32_t kId = 5;
  static constexpr bool kSpreads = true;
  static constexpr bool kFilters = true;
  static constexpr PolicyInfo kInfo{"directional", "Directional",
                                    "forgets only along the regressor",
                                    "Lai, Bernstein (SIFt), arXiv 2404.10844"};

  Scalar lambda = Scalar(0.94);
  Scalar epsilon = Scalar(1e-4);

  template <class Visit>
  static constexpr void settings(Visit visit) {
    visit(
        SettingInfo{"lambda", Range::factor(), "1",
                    "forgetting factor, for a memory that looks like n / (1 - lambda) samples", 0},
        [](auto& owner) -> auto& { return owner.lambda; });
    visit(SettingInfo{"epsilon", Range::above(0.0), "1",
                      "least phi' phi, of the scaled signals, of a sample with information", 8},
          [](auto& owner) -> auto& { return owner.epsilon; });
  }

  bool valid() const { return settings_valid(*this); }
  void restart() {}
  ForgettingFactors<Scalar> peek(const Evidence<Scalar>& /*evidence*/) const {
    return {Scalar(1), Scalar(1)};
  }
  void accept(const Evidence<Scalar>& /*evidence*/) {}

  /// Directions that are not excited are not forgotten: only the paper's filter is needed.
  Scalar loss(int /*parameter*/, Scalar /*variance*/) const { return Scalar(0); }

  template <class Regressor>
  bool filters(const Regressor& phi) const {
    return dot(static_cast<int>(phi.size()), phi, phi) < epsilon;
  }

  template <int kN>
  EHSID_ALWAYS_INLINE void spread(UdFactors<Scalar, kN>& factors,
                                  const Vector<Scalar, kN>& phi) const {
    const int n = factors.size();
    const Scalar held = factors.information_along(phi);
    Array<Scalar, kN> direction;
    EHSID_UNROLL
    for (int i = 0; i < n; ++i) {
      direction[static_cast<std::size_t>(i)] = phi[i];
    }
    // P + (1 - lambda) / (lambda phi' P^-1 phi) phi phi'
    factors.add_rank_one((Scalar(1) - lambda) / (lambda * held), direction);
  }
};

}  // namespace ehsid
