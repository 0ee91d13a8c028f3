// SPDX-License-Identifier: MIT
// liquid-dsp eqrls_rrrf, in float. It is an equaliser: the regressor is its window of the last n values pushed, so that an
// update here is n pushes and a step. It always starts from P0 = 10 I.
#include <liquid/liquid.h>

#include <vector>

#include "families.hpp"

namespace {

constexpr double kVariance0 = 10.0;

class Form {
 public:
  static constexpr bool kMakesRegressor = false;
  struct Input {
    std::vector<float> phi;
    float y;
  };

  explicit Form(int n) : n_(static_cast<std::size_t>(n)) {
    std::vector<float> zeros(n_, 0.0F);
    equaliser_ = eqrls_rrrf_create(zeros.data(), static_cast<unsigned>(n));
  }
  Form(const Form&) = delete;
  Form& operator=(const Form&) = delete;
  ~Form() { eqrls_rrrf_destroy(equaliser_); }

  Input input(const peers::Sample& sample) const {
    return {std::vector<float>(sample.phi, sample.phi + n_), static_cast<float>(sample.y)};
  }
  peers::Prior start(const peers::Settings& settings) {
    eqrls_rrrf_reset(equaliser_);
    eqrls_rrrf_set_bw(equaliser_, static_cast<float>(settings.lambda));
    return {kVariance0, false};
  }
  void update(const Input& input) {
    for (const float value : input.phi) {
      eqrls_rrrf_push(equaliser_, value);
    }
    float predicted = 0.0F;
    eqrls_rrrf_execute(equaliser_, &predicted);
    eqrls_rrrf_step(equaliser_, input.y, predicted);
  }
  void theta(double* to) const {
    std::vector<float> newest_first(n_);
    eqrls_rrrf_get_weights(equaliser_, newest_first.data());
    for (std::size_t i = 0; i < n_; ++i) {
      to[i] = static_cast<double>(newest_first[n_ - 1 - i]);
    }
  }

 private:
  std::size_t n_;
  eqrls_rrrf equaliser_;
};

}  // namespace

namespace peers {

void add_liquid(Entries& entries, int n) {
  add<Form>(entries, "liquid-dsp eqrls_rrrf", "float", false, n);
}

}  // namespace peers
