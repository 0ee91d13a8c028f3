// SPDX-License-Identifier: MIT
// Forgetting policies: how fast the past loses its weight. Chosen at compile time, one file each.
//
// A policy is a plain, trivially copyable struct (it is part of every snapshot) over a number T, written in select form so
// that a bank can have a register of many in place of T: see forgetting/select.hpp. It has
//   Over<Lanes>                the same policy over another type
//   kId                        number that identifies the policy in a snapshot, never reused
//   kFollowsErrors             do large errors shorten its memory?
//   kInfo                      its description, see settings.hpp
//   settings(visit)            calls visit(description, member) for each setting; member(owner) is the setting in
//                              a policy, or in another struct whose member has the same name
//   fields(visit)              where it has a state beside its settings: lists the members of that state, as in
//                              fields.hpp, so that snapshots save them
//   valid()                    are its settings inside their ranges, and its state usable?
//   restart(where)             back to the initial state, e.g. after a reset; in the lanes where `where` is true
//   loss()                     share of the information that an ordinary step forgets: a lone held direction settles at
//                              phi' P phi = loss, full excitation at n loss; 0 where a sample replaces all that is
//                              forgotten for it
//   peek(evidence)             the scalar forgetting of the coming step; changes nothing
//   accept(evidence, where)    the step was kept: move the policy's own state on, in the lanes where `where` is true
//
// The policies and their settings, e.g. `options.forgetting.eta = 1.0F`:
//
// settings: written by script/policies.py
//   Constant: constant forgetting factor
//     lambda in (0, 1], default 0.99: forgetting factor, for a memory of 1 / (1 - lambda) samples; 1 is ordinary least squares
//   Exponential: lambda tends to one; does not follow later changes without a reset
//     lambda0 in (0, 1], default 0.99: rate at which the forgetting factor goes to one
//     lambda_initial in (0, 1], default 0.95: forgetting factor at the start, lambda(0)
//   ErrorDriven: a large error shortens the memory
//     memory >= 1 samples, default 100: N0, the memory in the steady state
//     lambda_min in (0, 1], default 0.5: the forgetting factor never goes below this
//     noise_variance >= 0, default 0: sigma0^2, in squared units of the scaled output; 0 estimates it
//   FRatio: forgets where recent errors (10 samples) significantly exceed older ones (100 samples)
//     eta >= 0, default 2: aggressiveness: lambda = 1 / (1 + eta g)
//     critical_ratio >= 1, default 3.3: F_crit, ratio of mean squared errors above which something has changed
// end of settings
//
// A new policy is a file in forgetting/ and its line in `Policies` below; then `python script/policies.py` writes the
// lists of the C header, the Python signatures and the documents anew.
#pragma once

#include <ehsid/forgetting/constant.hpp>
#include <ehsid/forgetting/error_driven.hpp>
#include <ehsid/forgetting/exponential.hpp>
#include <ehsid/forgetting/f_ratio.hpp>

#include <tuple>
#include <type_traits>
#include <utility>

namespace ehsid {

/// All policies. A new one comes last: the place of a policy is its number in the HIL protocol.
// clang-format off
template <class Scalar>
using Policies = std::tuple<
    Constant<Scalar>,
    Exponential<Scalar>,
    ErrorDriven<Scalar>,
    FRatio<Scalar>>;
// clang-format on

inline constexpr std::size_t kPolicies = std::tuple_size<Policies<float>>::value;

/// The policy at a place of the list, from 0 on.
template <std::size_t kPlace, class Scalar>
using PolicyAt = typename std::tuple_element<kPlace, Policies<Scalar>>::type;

namespace detail {

template <class Visit, std::size_t... kPlaces>
constexpr void each_place(Visit& visit, std::index_sequence<kPlaces...> /*places*/) {
  (visit(std::integral_constant<std::size_t, kPlaces>{}), ...);
}

}  // namespace detail

/// Calls visit(std::integral_constant<std::size_t, place>) for each policy, in the order of the list.
template <class Visit>
constexpr void for_each_policy(Visit visit) {
  detail::each_place(visit, std::make_index_sequence<kPolicies>{});
}

/// The place of the policy with this id in the list; kPolicies where there is none.
constexpr std::size_t place_of_policy(const char* id) {
  std::size_t result = kPolicies;
  for_each_policy([&](auto place) {
    const char* name = PolicyAt<place, float>::kInfo.id;
    std::size_t i = 0;
    while (name[i] != '\0' && name[i] == id[i]) {
      ++i;
    }
    result = name[i] == id[i] ? place.value : result;
  });
  return result;
}

namespace detail {

constexpr bool ids_follow_the_list() {
  bool good = true;
  for_each_policy(
      [&](auto place) { good = good && PolicyAt<place, float>::kId == place.value + 1; });
  return good;
}

constexpr bool hil_places_differ() {
  bool good = true;
  for_each_policy([&](auto place) {
    unsigned taken = 0;
    PolicyAt<place, float>::settings([&](const SettingInfo& setting, auto /*member*/) {
      const bool inside = setting.hil_place >= 0 && setting.hil_place < kHilPlaces;
      const unsigned bit = inside ? 1U << static_cast<unsigned>(setting.hil_place) : 0U;
      good = good && bit != 0U && (taken & bit) == 0U;
      taken |= bit;
    });
  });
  return good;
}

}  // namespace detail

static_assert(detail::ids_follow_the_list(), "kId of a policy is its place in Policies, from 1 on");
static_assert(detail::hil_places_differ(),
              "each setting of a policy takes another hil_place, from 0 to kHilPlaces - 1");

}  // namespace ehsid
