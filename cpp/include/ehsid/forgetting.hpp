// SPDX-License-Identifier: MIT
// Forgetting policies: how fast the past loses its weight. Chosen at compile time, one file each.
//
// A policy is a plain, trivially copyable struct (it is part of every snapshot) with
//   kId                        number that identifies the policy in a snapshot, never reused
//   valid()                    are its parameters inside their documented ranges?
//   restart()                  back to the initial state, e.g. after a reset
//   loss(factors)              information forgotten in a step and direction, d(log det P) / n: a lone held
//                              direction settles at phi' P phi = loss, full excitation at n loss; 0 where
//                              a sample replaces all that is forgotten for it
//   peek(evidence)             the scalar forgetting of the coming step; changes nothing
//   accept(evidence)           the step was kept: move the policy's own state on
//   spread(factors, phi)       where kSpreads: the time update of a covariance that is not simply
//                              divided by a factor
//   filters(phi)               where kFilters: samples that the policy itself leaves out
#pragma once

#include <ehsid/forgetting/constant.hpp>
#include <ehsid/forgetting/directional.hpp>
#include <ehsid/forgetting/error_driven.hpp>
#include <ehsid/forgetting/exponential.hpp>
#include <ehsid/forgetting/f_ratio.hpp>
#include <ehsid/forgetting/random_walk.hpp>
