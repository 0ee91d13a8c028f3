// SPDX-License-Identifier: MIT
// A co-simulation FMU that is loaded and initialised elsewhere, stepped by the addresses of its functions.
// Functional Mock-up Interface, Modelica Association: 2.0 (2014), ch. 2.1.7 and 4.2; 3.0 (2022), ch. 2.2.6 and 4.2.
#pragma once

#include <ehsid/plant/outside.hpp>

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

namespace ehsid::plant {

/// A variable of an FMU that stands for an input or an output: its value = scale SI + offset.
struct FmuVariable {
  std::size_t place = 0;  // in OutsideInputs or OutsideOutputs
  std::uint32_t reference = 0;
  double scale = 1.0;
  double offset = 0.0;
};

/// Addresses of functions, and of the instance that they work on.
struct FmuAddresses {
  int major = 2;  // of FMI: 2 or 3
  std::uintptr_t instance = 0;
  std::uintptr_t set_real = 0;  // fmi2SetReal or fmi3SetFloat64
  std::uintptr_t get_real = 0;
  std::uintptr_t do_step = 0;
};

class Fmu final : public OutsideSimulator {
 public:
  Fmu(const FmuAddresses& addresses, std::vector<FmuVariable> inputs,
      std::vector<FmuVariable> outputs)
      : addresses_(addresses), inputs_(std::move(inputs)), outputs_(std::move(outputs)) {
    for (const FmuVariable& each : inputs_) {
      input_references_.push_back(each.reference);
    }
    for (const FmuVariable& each : outputs_) {
      output_references_.push_back(each.reference);
    }
    set_.resize(inputs_.size());
    got_.resize(outputs_.size());
  }

  bool read(OutsideOutputs& outputs) override {
    outputs.fill(std::nan(""));
    if (!transfer<double>(addresses_.get_real, output_references_, got_)) {
      return false;
    }
    for (std::size_t i = 0; i < outputs_.size(); ++i) {
      outputs[outputs_[i].place] = (got_[i] - outputs_[i].offset) / outputs_[i].scale;
    }
    return true;
  }

  bool step(double time, double h, const OutsideInputs& inputs) override {
    for (std::size_t i = 0; i < inputs_.size(); ++i) {
      set_[i] = inputs_[i].scale * inputs[inputs_[i].place] + inputs_[i].offset;
    }
    return transfer<const double>(addresses_.set_real, input_references_, set_) && advance(time, h);
  }

 private:
  /// A warning is no failure; errors, a step that is discarded or goes on by itself are.
  static bool done(int status) { return status == 0 || status == 1; }

  template <class Number, class Values>
  bool transfer(std::uintptr_t address, const std::vector<std::uint32_t>& references,
                Values& values) const {
    void* const instance = pointer(addresses_.instance);
    const std::size_t count = references.size();
    if (addresses_.major == 2) {
      const auto call = function<int(void*, const std::uint32_t*, std::size_t, Number*)>(address);
      return done(call(instance, references.data(), count, values.data()));
    }
    const auto call =
        function<int(void*, const std::uint32_t*, std::size_t, Number*, std::size_t)>(address);
    return done(call(instance, references.data(), count, values.data(), count));
  }

  bool advance(double time, double h) const {
    void* const instance = pointer(addresses_.instance);
    if (addresses_.major == 2) {
      return done(
          function<int(void*, double, double, int)>(addresses_.do_step)(instance, time, h, 1));
    }
    bool event = false;
    bool terminate = false;
    bool early = false;
    double last = time;
    const auto call = function<int(void*, double, double, bool, bool*, bool*, bool*, double*)>(
        addresses_.do_step);
    return done(call(instance, time, h, true, &event, &terminate, &early, &last)) && !terminate &&
           !early;
  }

  // The addresses come from a library that Python has loaded.
  static void* pointer(std::uintptr_t address) {
    return reinterpret_cast<void*>(address);  // NOLINT(performance-no-int-to-ptr)
  }
  template <class Signature>
  static Signature* function(std::uintptr_t address) {
    return reinterpret_cast<Signature*>(address);  // NOLINT(performance-no-int-to-ptr)
  }

  FmuAddresses addresses_;
  std::vector<FmuVariable> inputs_, outputs_;
  std::vector<std::uint32_t> input_references_, output_references_;
  std::vector<double> set_, got_;
};

}  // namespace ehsid::plant
