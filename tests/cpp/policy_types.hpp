// SPDX-License-Identifier: MIT
// The list of the forgetting policies as GoogleTest takes types.
#pragma once

#include <ehsid/forgetting.hpp>

#include <gtest/gtest.h>

namespace test {

template <class List>
struct TypesOf;
template <class... Policy>
struct TypesOf<std::tuple<Policy...>> {
  using Type = testing::Types<Policy...>;
};

template <class Scalar>
using PolicyTypes = typename TypesOf<ehsid::Policies<Scalar>>::Type;

}  // namespace test
