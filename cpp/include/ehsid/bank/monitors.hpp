// SPDX-License-Identifier: MIT
// What watches the recursion of each lane: the equations of reset.hpp, monitor.hpp and whiteness.hpp with a choice in place
// of each branch.
#pragma once

#include <ehsid/bank/recursions.hpp>
#include <ehsid/monitor.hpp>
#include <ehsid/reset.hpp>
#include <ehsid/whiteness.hpp>

namespace ehsid::bank {

/// Integers as wide as the numbers of V.
template <class V>
using CountsOf = Lanes<Whole<typename V::Number>, V::kWidth>;

/// The number of integers from 0 to 2^31 - 1.
template <class V>
EHSID_ALWAYS_INLINE inline V number(const CountsOf<V>& count) {
  V numbers;
  if constexpr (sizeof(typename V::Number) == sizeof(float)) {
    numbers.native = __builtin_convertvector(count.native, typename V::Native);
  } else {
    // 2^52 + count, of which the last bits are those of the count: no machine before AVX-512 converts 64 bits.
    constexpr double kPower = 4503599627370496.0;
    const CountsOf<V> sum(count.native | CountsOf<V>(0x4330000000000000).native);
    numbers.native = reinterpret_cast<typename V::Native>(sum.native);
    numbers -= V(kPower);
  }
  return numbers;
}

/// RmseReset in each lane.
template <class V>
struct Resets {
  using Scalar = typename V::Number;
  using Truth = typename V::Truth;
  using Count = CountsOf<V>;

  V short_square;
  V long_square;
  Count seen;
  Count cooling;
  Count alarms;
  Count armed;

  template <class Visit>
  static constexpr void fields(Visit visit) {
    visit(&Resets::short_square);
    visit(&Resets::long_square);
    visit(&Resets::seen);
    visit(&Resets::cooling);
    visit(&Resets::alarms);
    visit(&Resets::armed);
  }
};

/// RmseResetOptions in each lane.
template <class V>
struct ResetOptions {
  V short_window;
  V long_window;
  V trigger_ratio;
  V release_ratio;
  CountsOf<V> cool_down;
  V floor;

  template <class Visit>
  static constexpr void fields(Visit visit) {
    visit(&ResetOptions::short_window);
    visit(&ResetOptions::long_window);
    visit(&ResetOptions::trigger_ratio);
    visit(&ResetOptions::release_ratio);
    visit(&ResetOptions::cool_down);
    visit(&ResetOptions::floor);
  }
};

/// As RmseReset::update, and suspect() after it in the lanes of `moved`, in the lanes of `where`. True: reset now.
template <class V>
EHSID_ALWAYS_INLINE inline typename V::Truth update(
    Resets<V>& state, const ResetOptions<V>& options, const typename V::Truth& where,
    const typename V::Truth& moved, const typename V::Truth& stays, const V& square) {
  using Count = CountsOf<V>;
  const Count last(0x7fffffff);
  const Count zero(0);
  const Count one(1);
  const V before = state.long_square;
  const auto warm = number<V>(state.seen) >= options.long_window;
  const Count seen = select(warm | (state.seen == last), state.seen, state.seen + one);
  const V count = number<V>(seen);
  const V reference = before + options.floor * options.floor;
  using One = RmseReset<typename V::Number>;
  const V limit = options.trigger_ratio * options.trigger_ratio * reference;
  const auto known = count > options.short_window;
  const V in_short = select(known, smaller(square, V(One::kMostShort) * limit), square);
  const V in_long = select(known, smaller(square, V(One::kMostLong) * reference), square);
  const V short_square =
      state.short_square + (in_short - state.short_square) / smaller(count, options.short_window);
  const V long_square =
      state.long_square + (in_long - state.long_square) / smaller(count, options.long_window);
  const auto cooling = state.cooling > zero;
  const Count suspecting(RmseReset<typename V::Number>::kSuspecting);
  const auto unarmed = state.armed == zero;
  const V release = options.release_ratio * options.release_ratio;
  const auto usual = short_square < release * reference;
  const auto over = usual & stays & (state.armed == suspecting);
  const auto alarm = where & ~cooling & ~unarmed & warm & (over | (short_square > limit));

  state.seen = select(where, seen, state.seen);
  state.short_square = select(where, short_square, state.short_square);
  state.long_square = select(where, long_square, state.long_square);
  state.armed = select(where & ~cooling & unarmed & usual, one, state.armed);
  state.cooling = select(where & cooling, state.cooling - one, state.cooling);
  if (any(alarm)) {
    state.short_square = select(alarm, before, state.short_square);
    state.long_square = select(alarm, before, state.long_square);
    state.armed = select(alarm, zero, state.armed);
    state.cooling = select(alarm, options.cool_down, state.cooling);
    state.alarms = select(alarm & (state.alarms < last), state.alarms + one, state.alarms);
  }
  state.armed = select(where & moved & (state.armed == one), suspecting, state.armed);
  return alarm;
}

/// ConvergenceState in each lane.
template <class V>
struct Convergences {
  CountsOf<V> steady;
  CountsOf<V> samples;
  V excitation;

  template <class Visit>
  static constexpr void fields(Visit visit) {
    visit(&Convergences::steady);
    visit(&Convergences::samples);
    visit(&Convergences::excitation);
  }
};

/// ConvergenceOptions in each lane.
template <class V>
struct ConvergenceSettings {
  V tolerance;
  V magnitude;
  CountsOf<V> hold;

  template <class Visit>
  static constexpr void fields(Visit visit) {
    visit(&ConvergenceSettings::tolerance);
    visit(&ConvergenceSettings::magnitude);
    visit(&ConvergenceSettings::hold);
  }
};

/// As ConvergenceMonitor::updated in the lanes of `kept`, and skipped() in those of `skipped`.
template <class Tile, class V>
EHSID_ALWAYS_INLINE inline void update(Convergences<V>& state,
                                       const ConvergenceSettings<V>& options, const Tile& tile,
                                       const typename V::Truth& kept,
                                       const typename V::Truth& skipped) {
  using Scalar = typename V::Number;
  using Count = CountsOf<V>;
  const Count one(1);
  const auto counted = kept | skipped;
  const Count samples =
      select(counted & (state.samples < Count(0x7fffffff)), state.samples + one, state.samples);
  state.samples = samples;
  const V window = smaller(number<V>(samples), V(Scalar(100)));
  const V now = select(kept & ~tile.starved(), V(1), V(0));
  V excitation = state.excitation + (now - state.excitation) / window;
  excitation = select(excitation > V(Scalar(1e-6)), excitation, V(0));
  state.excitation = select(counted, excitation, state.excitation);

  if (!any(kept)) {
    return;
  }
  const int n = tile.size();
  const V variance = tile.parameter_variance();
  const V share = options.tolerance * options.tolerance;
  const V least = options.magnitude * options.magnitude;
  Array<V, Tile::kN> variances;
  tile.variances(variances);
  auto inside = tile.weight() > V(Scalar(2 * n));
  EHSID_UNROLL
  for (int i = 0; i < n; ++i) {
    const auto at = static_cast<std::size_t>(i);
    const V size = larger(tile.theta()[at] * tile.theta()[at], least);
    inside = (variance * variances[at] <= share * size) & inside;
  }
  const Count steady = select(state.steady < options.hold, state.steady + one, state.steady);
  state.steady = select(kept, select(inside, steady, Count(0)), state.steady);
}

/// WhitenessState in each lane.
template <class V>
struct Whitenesses {
  using Scalar = typename V::Number;
  using Truth = typename V::Truth;
  using One = WhitenessState<Scalar>;

  Array<V, One::kErrors> errors;
  Array<V, One::kCommands> commands;
  Array<V, One::kTests> sums;
  Array<V, One::kTests> squares;
  V partial;
  V statistic;
  CountsOf<V> samples;
  CountsOf<V> tested;
  CountsOf<V> next;
  CountsOf<V> coloured;

  template <class Visit>
  static constexpr void fields(Visit visit) {
    visit(&Whitenesses::errors);
    visit(&Whitenesses::commands);
    visit(&Whitenesses::sums);
    visit(&Whitenesses::squares);
    visit(&Whitenesses::partial);
    visit(&Whitenesses::statistic);
    visit(&Whitenesses::samples);
    visit(&Whitenesses::tested);
    visit(&Whitenesses::next);
    visit(&Whitenesses::coloured);
  }

  /// As WhitenessMonitor::updated in the lanes of `kept`, skipped() in those of `skipped` and interrupted() in those of
  /// `interrupted`.
  template <class Tile>
  EHSID_ALWAYS_INLINE void update(const Tile& tile, const V& leaving, const Truth& kept,
                                  const Truth& skipped, const Truth& interrupted) {
    using Count = CountsOf<V>;
    using Constants = WhitenessMonitor<Scalar>;
    const Count last(0x7fffffff);
    const Count zero(0);
    const Count one(1);
    V error(0);
    const auto estimated = kept & (tile.weight() > V(Scalar(2 * tile.size())));
    if (any(estimated)) {
      samples = select(estimated & (samples < last), samples + one, samples);
      const auto large = estimated & (tile.normalised_square() >
                                      V(Constants::kSmallestError * Constants::kSmallestError));
      tested = select(large & (tested < last), tested + one, tested);
      const V size =
          smaller(sqrt(tile.normalised_square() / tile.mean_square()), V(Constants::kLargestError));
      error = select(large, select(tile.innovation() < V(0), -size, size), error);

      const V rho = larger(smaller(tile.forgetting_factor(), V(Constants::kLongest)),
                           V(Constants::kShortest));
      const V rho_square = rho * rho;
      const Count place = next;
      V sum = partial;
      EHSID_UNROLL
      for (std::size_t i = 0; i < One::kTests; ++i) {
        const V past = i < One::kErrors ? errors[i] : commands[2 * (i - One::kErrors)];
        const V product = error * past;
        sums[i] = select(estimated, rho * sums[i] + product, sums[i]);
        squares[i] = select(estimated, rho_square * squares[i] + product * product, squares[i]);
      }
      if (all(place == Count(place[0]))) {
        sum += term(static_cast<std::size_t>(place[0]));
      } else {
        EHSID_UNROLL
        for (std::size_t i = 0; i < One::kTests; ++i) {
          sum = select(place == Count(static_cast<Whole<Scalar>>(i)), sum + term(i), sum);
        }
      }
      partial = select(estimated, sum, partial);
      next = select(estimated, place + one, place);
      const auto full = next == Count(One::kTests);
      if (any(full)) {
        statistic = select(full, partial, statistic);
        partial = select(full, V(0), partial);
        next = select(full, zero, next);
        const V most = select(coloured != zero, V(Constants::kRelease), V(Constants::kAlarm));
        const auto alarm = (tested >= Count(Constants::kFewest)) & (statistic > most);
        coloured = select(full, select(alarm, one, zero), coloured);
      }
    }

    const auto moved = kept | skipped;
    const V limit(Constants::kLargestCommand);
    const V bounded = select(leaving > limit, limit, select(leaving < -limit, -limit, leaving));
    EHSID_UNROLL
    for (std::size_t i = One::kErrors - 1; i > 0; --i) {
      errors[i] = select(moved, errors[i - 1], errors[i]);
    }
    errors[0] = select(moved, error, errors[0]);
    EHSID_UNROLL
    for (std::size_t i = One::kCommands - 1; i > 0; --i) {
      commands[i] = select(moved, commands[i - 1], commands[i]);
    }
    commands[0] = select(moved, bounded, commands[0]);
    if (any(interrupted)) {
      for (V& past : errors) {
        past = select(interrupted, V(0), past);
      }
      for (V& past : commands) {
        past = select(interrupted, V(0), past);
      }
    }
  }

  /// As WhitenessMonitor::moved_far() in the lanes of `kept`.
  template <class Tile>
  EHSID_ALWAYS_INLINE Truth moved_far(const Tile& tile, const V& leverage, const Truth& kept) {
    using Constants = WhitenessMonitor<Scalar>;
    const V& square = tile.normalised_square();
    const V before = tile.mean_square() - square / tile.weight();
    const Truth far = kept & (tile.weight() > V(Scalar(Constants::kFewestEach * tile.size()))) &
                      (square > V(Constants::kSmallestError * Constants::kSmallestError)) &
                      (square * leverage > V(Constants::kMostMoved) * before);
    if (any(far)) {
      samples = select(far, CountsOf<V>(0), samples);
    }
    return far;
  }

 private:
  /// S^2 / V of test i.
  EHSID_ALWAYS_INLINE V term(std::size_t i) const {
    Extreme<Scalar, V::kWidth> sizes;
    sizes.value_of(squares[i]);
    return select(sizes.all_normal_positive(), sums[i] * sums[i] / squares[i], V(0));
  }
};

/// Every number of the state zero where the mask is true.
template <class State, class Truth>
EHSID_ALWAYS_INLINE inline void clear(State& state, const Truth& where) {
  if (any(where)) {
    detail::each_value(state, [&](auto& lanes) EHSID_INLINE_LAMBDA {
      using Plain = std::remove_reference_t<decltype(lanes)>;
      lanes = select(where, Plain(0), lanes);
    });
  }
}

}  // namespace ehsid::bank
