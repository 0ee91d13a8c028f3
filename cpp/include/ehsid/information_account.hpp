// SPDX-License-Identifier: MIT
// Is every parameter excited? An account of the information that samples bring about it and that forgetting takes away.
//
// A sample takes (P phi)_i^2 / alpha off P_ii: this share of P_ii is added to the account of parameter i. A step of
// forgetting takes a share of the information about it away (Forgetting::loss): the account loses this share of itself.
// In a steady state of any excitation P_ii comes back to where it was, gains equal losses, and the account is 1 on
// average. Without information it falls by a factor of e in the memory of the policy. Unlike phi' P phi, which weighs all
// directions together, it sees that one parameter is not excited while noise excites the others.
#pragma once

#include <ehsid/fields.hpp>
#include <ehsid/forgetting/evidence.hpp>
#include <ehsid/groups.hpp>
#include <ehsid/types.hpp>

namespace ehsid {

/// Part of the state of a recursion. Plain data.
template <class Scalar, int kN>
struct InformationAccount {
  /// What waits for information.
  struct Waiting {
    Scalar postponed;  // product of forgetting factors, kLongest to 1
    Scalar waited;     // the same of 1 - loss, which is below 1 even where nothing is forgotten

    template <class Visit>
    EHSID_ALWAYS_INLINE static constexpr void fields(Visit visit) {
      visit(&Waiting::postponed);
      visit(&Waiting::waited);
    }
  };

  Array<Scalar, kN> regained;  // 0 to 1
  Waiting waiting;

  template <class Visit>
  EHSID_ALWAYS_INLINE static constexpr void fields(Visit visit) {
    visit(&InformationAccount::regained, each_parameter);
    visit(&InformationAccount::waiting);
  }

  void restart() {
    regained.fill(Scalar(1));
    waiting = {Scalar(1), Scalar(1)};
  }

  /// Has some parameter got too little information lately?
  EHSID_ALWAYS_INLINE bool starving(int n) const {
    Scalar least(1);
    upwards(count_of<kN>(n), [&](const int i) EHSID_INLINE_LAMBDA {
      const Scalar share = regained[static_cast<std::size_t>(i)];
      least = share < least ? share : least;
    });
    return least < kStarved;
  }

  /// Did the last kept sample find some parameter starving, so that its forgetting waits?
  bool waits() const { return waiting.waited < Scalar(1); }

  /// Has it waited for the longest time already?
  bool out_of_patience() const { return !(waiting.waited > kLongest); }

  /// Postpones the forgetting `lambda` of a step that forgets `loss`, which becomes 1. Returns what waits from then on.
  EHSID_ALWAYS_INLINE Waiting postpone(ForgettingFactors<Scalar>& lambda, Scalar loss) const {
    const Scalar all = waiting.postponed * lambda.before * lambda.after;
    const Scalar longer = waiting.waited * (Scalar(1) - loss);
    lambda = {Scalar(1), Scalar(1)};
    return {all > kLongest ? all : kLongest, longer > kLongest ? longer : kLongest};
  }

  /// Adds what was postponed to the forgetting of a step. Nothing waits from then on.
  EHSID_ALWAYS_INLINE Waiting make_up(ForgettingFactors<Scalar>& lambda) const {
    lambda.before *= waiting.postponed;
    return {Scalar(1), Scalar(1)};
  }

  /// A sample was left out. loss: share of the information that a step forgets.
  EHSID_ALWAYS_INLINE void lose(int n, Scalar loss) {
    for (int i = 0; i < n; ++i) {
      Scalar& share = regained[static_cast<std::size_t>(i)];
      share -= loss * share;
      share = share > kNothing ? share : Scalar(0);
    }
  }

  /// A sample was kept: it took taken(group) of the variances left(group) + taken(group), `loss` is forgotten.
  template <class Left, class Taken>
  EHSID_ALWAYS_INLINE void gain(int n, const Left& left, const Taken& taken, Scalar loss) {
    in_groups<Scalar>(count_of<kN>(n), [&](const auto group) EHSID_INLINE_LAMBDA {
      const auto share = group.load(regained.data());
      const auto off = taken(group);
      const auto next = share + (off / (left(group) + off) - loss * share);
      group.store(group.smaller(next, Scalar(1)), regained.data());
    });
  }

  /// May this saved state be taken over?
  bool usable(int n) const {
    bool good = possible(waiting.postponed) && possible(waiting.waited);
    for (int i = 0; i < n; ++i) {
      const Scalar share = regained[static_cast<std::size_t>(i)];
      good = share >= Scalar(0) && share <= Scalar(1) && good;
    }
    return good;
  }

 private:
  template <class, class>
  friend class bank::Recursions;

  // Starved: less than this share of what was forgotten. Excitation of any colour brings 1 on average, and nothing at
  // all leaves exp(-1) after one memory.
  static constexpr Scalar kStarved = Scalar(0.4);
  // Forgetting waits for two and a half memories at most, exp(-2.5).
  static constexpr Scalar kLongest = Scalar(0.08);
  // A share below this counts as none: a product that goes on falling would be denormal, which is slow.
  static constexpr Scalar kNothing = Scalar(1e-6);

  static bool possible(Scalar product) { return product >= kLongest && product <= Scalar(1); }
};

}  // namespace ehsid
