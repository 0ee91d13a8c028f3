// SPDX-License-Identifier: MIT
// dlib::rls, in double and with sizes at run time. C is P0; its regularisation keeps P0 in force while forgetting, and can
// be switched off.
#include <dlib/matrix.h>
#include <dlib/svm/rls.h>

#include "families.hpp"

namespace {

struct Form {
  using Vector = dlib::matrix<double, 0, 1>;
  static constexpr bool kMakesRegressor = false;
  struct Input {
    Vector phi;
    double y;
  };

  Form(int n, bool regularised) : n_(n), regularised_(regularised) {}
  Input input(const peers::Sample& sample) const {
    Input converted{Vector(n_), sample.y};
    for (int i = 0; i < n_; ++i) {
      converted.phi(i) = sample.phi[i];
    }
    return converted;
  }
  peers::Prior start(const peers::Settings& settings) {
    recursion_ = dlib::rls(settings.lambda, settings.variance0, !regularised_);
    return {settings.variance0, regularised_};
  }
  void update(const Input& input) { recursion_.train(input.phi, input.y); }
  void theta(double* to) const {
    for (int i = 0; i < n_; ++i) {
      to[i] = recursion_.get_w().size() == 0 ? 0.0 : recursion_.get_w()(i);
    }
  }

 private:
  int n_;
  bool regularised_;
  dlib::rls recursion_;
};

}  // namespace

namespace peers {

void add_dlib(Entries& entries, int n) {
  add<Form>(entries, "dlib rls", "double", false, n, true);
  add<Form>(entries, "dlib rls, not regularised", "double", false, n, false);
}

}  // namespace peers
