// SPDX-License-Identifier: MIT
// All effects, in the order in which they act on the command path and in the sensor. A new effect is a file of its
// own and its name here; simulation, bindings, rigs, diagnosis and documents read the rest from it (description.hpp).
#pragma once

#include <ehsid/plant/effects/contact_spring.hpp>
#include <ehsid/plant/effects/coulomb_friction.hpp>
#include <ehsid/plant/effects/coulomb_friction_sides.hpp>
#include <ehsid/plant/effects/counterbalance_valve.hpp>
#include <ehsid/plant/effects/entrained_air.hpp>
#include <ehsid/plant/effects/external_leakage.hpp>
#include <ehsid/plant/effects/flexible_load.hpp>
#include <ehsid/plant/effects/flow_gain_drift.hpp>
#include <ehsid/plant/effects/internal_leakage.hpp>
#include <ehsid/plant/effects/line_resonance.hpp>
#include <ehsid/plant/effects/load_force.hpp>
#include <ehsid/plant/effects/load_spring.hpp>
#include <ehsid/plant/effects/makeup_check.hpp>
#include <ehsid/plant/effects/position_friction.hpp>
#include <ehsid/plant/effects/position_sensor_delay.hpp>
#include <ehsid/plant/effects/pressure_sensor_gain.hpp>
#include <ehsid/plant/effects/pressure_sensor_lag.hpp>
#include <ehsid/plant/effects/pressure_sensor_offset.hpp>
#include <ehsid/plant/effects/relief_valve.hpp>
#include <ehsid/plant/effects/sensor_backlash.hpp>
#include <ehsid/plant/effects/sensor_lag.hpp>
#include <ehsid/plant/effects/sensor_nonlinearity.hpp>
#include <ehsid/plant/effects/sensor_quantisation.hpp>
#include <ehsid/plant/effects/spool_stiction.hpp>
#include <ehsid/plant/effects/stribeck_friction.hpp>
#include <ehsid/plant/effects/supply_droop.hpp>
#include <ehsid/plant/effects/transport_delay.hpp>
#include <ehsid/plant/effects/valve_dead_band.hpp>
#include <ehsid/plant/effects/valve_dead_band_sides.hpp>
#include <ehsid/plant/effects/valve_flow_saturation.hpp>
#include <ehsid/plant/effects/valve_hysteresis.hpp>
#include <ehsid/plant/effects/valve_lag.hpp>
#include <ehsid/plant/effects/valve_null_bias.hpp>

#include <cstddef>
#include <tuple>
#include <type_traits>
#include <utility>
#include <vector>

namespace ehsid::plant {

template <class Scalar>
using Catalogue =
    std::tuple<TransportDelay<Scalar>, ValveHysteresis<Scalar>, SpoolStiction<Scalar>,
               ValveLag<Scalar>, ValveNullBias<Scalar>, ValveFlowSaturation<Scalar>,
               ValveDeadBand<Scalar>, ValveDeadBandSides<Scalar>, FlowGainDrift<Scalar>,
               InternalLeakage<Scalar>, ExternalLeakage<Scalar>, ReliefValve<Scalar>,
               MakeupCheck<Scalar>, CounterbalanceValve<Scalar>, EntrainedAir<Scalar>,
               SupplyDroop<Scalar>, LineResonance<Scalar>, CoulombFriction<Scalar>,
               CoulombFrictionSides<Scalar>, StribeckFriction<Scalar>, PositionFriction<Scalar>,
               LoadSpring<Scalar>, LoadForce<Scalar>, ContactSpring<Scalar>, FlexibleLoad<Scalar>,
               SensorBacklash<Scalar>, SensorNonlinearity<Scalar>, SensorLag<Scalar>,
               PositionSensorDelay<Scalar>, SensorQuantisation<Scalar>, PressureSensorGain<Scalar>,
               PressureSensorOffset<Scalar>, PressureSensorLag<Scalar>>;

/// The effects of a plant. An effect is on where one of its parameters is not zero or is varied.
template <class Scalar>
class Effects {
 public:
  /// The parameters of all effects stand in `values` from `first` on.
  Effects(const std::vector<Scalar>& values, std::size_t first) {
    const auto tell = [&](auto& effect) {
      effect.active = false;
      for (Scalar& parameter : effect.parameters) {
        parameter = values[first++];
        effect.active = effect.active || !is_nothing(parameter);
      }
    };
    std::apply([&](auto&... effect) { (tell(effect), ...); }, all_);
  }

  /// Asks every effect that is on, in the order of the catalogue.
  template <class Place>
  void each(Place place) {
    std::apply([&](auto&... effect) { ((effect.active ? place(effect) : void()), ...); }, all_);
  }
  template <class Place>
  void each(Place place) const {
    std::apply([&](const auto&... effect) { ((effect.active ? place(effect) : void()), ...); },
               all_);
  }

  /// Of the command path, s.
  Scalar delay() const {
    return sum([](const auto& effect) { return effect.delay(); });
  }
  /// The sampled command as the spool follows it, fraction of rated command. Called once a sample of dt seconds,
  /// in order.
  Scalar command(Scalar u, double dt) {
    each([&](auto& effect) { put(u, effect.command(u, dt)); });
    return u;
  }
  /// Of the spool, where no effect says otherwise `lag`.
  SpoolLag<Scalar> spool_lag(SpoolLag<Scalar> lag = {}) const {
    each([&](const auto& effect) { put(lag, effect.spool_lag()); });
    return lag;
  }
  /// From the spool position, fractions of rated command.
  Scalar opening(Scalar x) const {
    each([&](const auto& effect) { put(x, effect.opening(x)); });
    return x;
  }
  /// Of the metering edges.
  Overlap<Scalar> overlap() const {
    return sum<Overlap<Scalar>>([](const auto& effect) { return effect.overlap(); });
  }
  /// Shares of the flow at the start of the record that the edges give, s after it: calls `use` with that of each effect
  /// that changes it.
  template <class Use>
  void flow_shares(double time, Use use) const {
    each([&](const auto& effect) {
      const auto share = effect.flow_share(time);
      if constexpr (!std::is_same_v<std::decay_t<decltype(share)>, Nothing>) {
        use(share);
      }
    });
  }
  SupplyLine<Scalar> supply_line() const {
    SupplyLine<Scalar> line{};
    each([&](const auto& effect) { put(line, effect.supply_line()); });
    return line;
  }
  PressureLine<Scalar> pressure_line() const {
    PressureLine<Scalar> line{};
    each([&](const auto& effect) { put(line, effect.pressure_line()); });
    return line;
  }
  /// From that of the fluid, at an absolute pressure, Pa.
  Scalar bulk_modulus(Scalar beta, const Scalar& pressure) const {
    each([&](const auto& effect) { put(beta, effect.bulk_modulus(beta, pressure)); });
    return beta;
  }
  /// Flows out of the chambers, m^3/s, at absolute pressures, Pa: calls `use` with the Leakage of each effect that leaks.
  template <class Use>
  void leakages(const Scalar& p_a, const Scalar& p_b, const Scalar& p_tank, Use use) const {
    each([&](const auto& effect) {
      const auto flows = effect.leakage(p_a, p_b, p_tank);
      if constexpr (!std::is_same_v<std::decay_t<decltype(flows)>, Nothing>) {
        use(flows);
      }
    });
  }
  Counterbalance<Scalar> counterbalance() const {
    Counterbalance<Scalar> valve{};
    each([&](const auto& effect) { put(valve, effect.counterbalance()); });
    return valve;
  }
  /// Whether a leakage is steep, so that it has a slope for the integration.
  bool leak_steeply() const {
    bool steep = false;
    each([&](const auto& effect) {
      const Scalar none(0.0);
      steep = steep || !std::is_same_v<decltype(effect.leakage_slope(none, none, none)), Nothing>;
    });
    return steep;
  }
  /// Of the steep leakages out of either chamber over its own pressure, from p to `ahead`, m^3/(s Pa).
  Scalar leakage_slope(const Scalar& p, const Scalar& ahead, const Scalar& p_tank) const {
    return sum([&](const auto& effect) { return effect.leakage_slope(p, ahead, p_tank); });
  }
  /// Of the seals, steady, N, >= 0.
  Scalar friction(const Sliding<Scalar>& now) const {
    return sum([&](const auto& effect) { return effect.friction(now); });
  }
  /// Force against extension at a distance from mid-stroke, N.
  Scalar load(const Scalar& from_middle) const {
    return sum([&](const auto& effect) { return effect.load(from_middle); });
  }
  Contact<Scalar> contact() const {
    Contact<Scalar> contact{};
    each([&](const auto& effect) { put(contact, effect.contact()); });
    return contact;
  }
  HangingLoad<Scalar> hanging_load() const {
    HangingLoad<Scalar> load{};
    each([&](const auto& effect) { put(load, effect.hanging_load()); });
    return load;
  }
  /// What the sensor makes of a position at which it has rested, m.
  Scalar start_sensor(Scalar position) {
    each([&](auto& effect) { put(position, effect.start_sensor(position)); });
    return position;
  }
  /// What the sensor makes of the position after a step of h seconds, m. Called once a step, in order.
  Scalar sense(Scalar position, double h) {
    each([&](auto& effect) { put(position, effect.sense(position, h)); });
    return position;
  }
  /// By how much the position must change for the reading to change by this much, m; the sensor's memory moves along.
  Scalar shift_sensor(Scalar change) {
    each_from_last([&](auto& effect) { put(change, effect.shift_sensor(change)); },
                   std::make_index_sequence<kCount>());
    return change;
  }
  /// Position for which the sensor gives a reading, but for its lag and its play, m.
  Scalar position_of(Scalar reading) const {
    each([&](const auto& effect) { put(reading, effect.position_of(reading)); });
    return reading;
  }
  /// What the record stores of the reading, m.
  Scalar store(Scalar reading) const {
    each([&](const auto& effect) { put(reading, effect.store(reading)); });
    return reading;
  }
  SensorError<Scalar> sensor_error() const {
    SensorError<Scalar> all{};
    each([&](const auto& effect) {
      const auto error = effect.sensor_error();
      if constexpr (!std::is_same_v<std::decay_t<decltype(error)>, Nothing>) {
        all.lag_s += error.lag_s;
        all.half_play_m += error.half_play_m;
      }
    });
    return all;
  }

  /// Whether an effect acts on the sensors of the chamber pressures.
  bool sense_pressures() const {
    bool any = false;
    each([&](const auto& effect) {
      using Each = std::decay_t<decltype(effect)>;
      const ChamberPressures<Scalar> none{};
      any = any ||
            !std::is_same_v<decltype(std::declval<Each&>().sense_pressures(none, 0.0)), Nothing>;
    });
    return any;
  }
  /// What the sensors of the chamber pressures make of those at which they have rested.
  ChamberPressures<Scalar> start_pressure_sensors(ChamberPressures<Scalar> p) {
    each([&](auto& effect) { put(p, effect.start_pressure_sensors(p)); });
    return p;
  }
  /// What they make of the pressures after a step of h seconds. Called once a step, in order.
  ChamberPressures<Scalar> sense_pressures(ChamberPressures<Scalar> p, double h) {
    each([&](auto& effect) { put(p, effect.sense_pressures(p, h)); });
    return p;
  }
  /// By how much the pressures must change for the readings to change by this much; the memory of the sensors moves along.
  ChamberPressures<Scalar> shift_pressure_sensors(ChamberPressures<Scalar> change) {
    each_from_last([&](auto& effect) { put(change, effect.shift_pressure_sensors(change)); },
                   std::make_index_sequence<kCount>());
    return change;
  }

 private:
  static constexpr std::size_t kCount = std::tuple_size_v<Catalogue<Scalar>>;

  template <class Place, std::size_t... kIndex>
  void each_from_last(Place place, std::index_sequence<kIndex...> /*all*/) {
    const auto ask = [&](auto& effect) { effect.active ? place(effect) : void(); };
    (ask(std::get<kCount - 1 - kIndex>(all_)), ...);
  }

  template <class Sum = Scalar, class Place>
  Sum sum(Place place) const {
    Sum all{};
    each([&](const auto& effect) { add(all, place(effect)); });
    return all;
  }

  Catalogue<Scalar> all_{};
};

}  // namespace ehsid::plant
