// SPDX-License-Identifier: MIT
// What every recursion that is compared looks like to the program: a start, an update, the parameters.
#pragma once

#include <cstddef>
#include <memory>
#include <string>
#include <utility>
#include <vector>

namespace peers {

/// One sample: phi = (-y(k-1) .. -y(k-na), u(k-1) .. u(k-nb)) and y(k), and u(k) for an estimator with a memory of its own.
struct Sample {
  const double* phi;
  double y;
  double u;
};

struct Settings {
  double lambda;     // forgetting factor
  double variance0;  // P0 = variance0 I
};

/// How the start enters what is minimised: a peer may start from a P0 of its own, and may keep it for ever.
struct Prior {
  double variance0;
  bool kept;
};

/// A recursion for a given number of parameters.
class Peer {
 public:
  Peer() = default;
  Peer(const Peer&) = delete;
  Peer& operator=(const Peer&) = delete;
  virtual ~Peer() = default;
  /// Back to theta = 0 and P0.
  virtual Prior start(const Settings& settings) = 0;
  /// One update; the sample is converted first, so this is not for measurements of time.
  virtual void update(const Sample& sample) = 0;
  /// Converts the samples that pass() will take.
  virtual void prepare(const std::vector<Sample>& samples) = 0;
  /// Updates with all prepared samples: this is what is timed.
  virtual void pass() = 0;
  /// Writes the n parameters.
  virtual void theta(double* to) const = 0;
  /// Does it make its regressor itself, from the samples before the first complete one on?
  virtual bool makes_regressor() const = 0;
};

/// Form has Input, input(sample), start(settings), update(input), theta(to), and kMakesRegressor: it takes u and y, not phi.
template <class Form>
class PeerOf final : public Peer {
 public:
  template <class... Arguments>
  explicit PeerOf(Arguments... arguments) : form_(arguments...) {}
  Prior start(const Settings& settings) override { return form_.start(settings); }
  void update(const Sample& sample) override { form_.update(form_.input(sample)); }
  void prepare(const std::vector<Sample>& samples) override {
    inputs_.clear();
    inputs_.reserve(samples.size());
    for (const Sample& sample : samples) {
      inputs_.push_back(form_.input(sample));
    }
  }
  void pass() override {
    for (const auto& input : inputs_) {
      form_.update(input);
    }
  }
  void theta(double* to) const override { form_.theta(to); }
  bool makes_regressor() const override { return Form::kMakesRegressor; }

 private:
  Form form_;
  std::vector<typename Form::Input> inputs_;
};

struct Entry {
  std::string name;
  std::string scalar;
  bool ours;
  std::unique_ptr<Peer> peer;
};

using Entries = std::vector<Entry>;

template <class Form, class... Arguments>
void add(Entries& entries, const char* name, const char* scalar, bool ours,
         Arguments... arguments) {
  entries.push_back({name, scalar, ours, std::make_unique<PeerOf<Form>>(arguments...)});
}

template <class Scalar>
constexpr const char* name_of() {
  return sizeof(Scalar) == sizeof(float) ? "float" : "double";
}

}  // namespace peers
