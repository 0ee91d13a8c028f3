// SPDX-License-Identifier: MIT
// What one writes oneself, for EHSID_N parameters: Eqs. (12)-(14) with Eigen in three ways, and two recursions in plain C.
#include <Eigen/Core>

#include <algorithm>
#include <array>

#include "families.hpp"

#define PLAIN_N EHSID_N
#define PLAIN_REAL float
#define PLAIN(name) name##_float
#include "plain_rls.h"
#undef PLAIN_REAL
#undef PLAIN
#define PLAIN_REAL double
#define PLAIN(name) name##_double
#include "plain_rls.h"

namespace {

using peers::Prior;
using peers::Sample;
using peers::Settings;

constexpr int kN = EHSID_N;

/// Eqs. (12) and (14) on a full matrix P, which `Bracketing` updates by (13).
template <class Scalar, class Bracketing>
struct Dense {
  using Vector = Eigen::Matrix<Scalar, kN, 1>;
  using Matrix = Eigen::Matrix<Scalar, kN, kN>;
  static constexpr bool kMakesRegressor = false;
  struct Input {
    Vector phi;
    Scalar y;
  };

  static Input input(const Sample& sample) {
    return {Eigen::Map<const Eigen::Matrix<double, kN, 1>>(sample.phi).template cast<Scalar>(),
            static_cast<Scalar>(sample.y)};
  }
  Prior start(const Settings& settings) {
    theta_.setZero();
    p_ = Matrix::Identity() * static_cast<Scalar>(settings.variance0);
    lambda_ = static_cast<Scalar>(settings.lambda);
    return {settings.variance0, false};
  }
  void update(const Input& input) {
    const Vector weighted = p_ * input.phi;
    const Vector k = weighted / (lambda_ + input.phi.dot(weighted));
    theta_ += k * (input.y - input.phi.dot(theta_));
    Bracketing::subtract(p_, k, input.phi, weighted);
    p_ /= lambda_;
  }
  void theta(double* to) const {
    Eigen::Map<Eigen::Matrix<double, kN, 1>>{to} = theta_.template cast<double>();
  }

 private:
  Vector theta_;
  Matrix p_;
  Scalar lambda_;
};

struct LeftToRight {
  template <class Matrix, class Vector>
  static void subtract(Matrix& p, const Vector& k, const Vector& phi, const Vector& /*weighted*/) {
    p -= k * phi.transpose() * p;
  }
};

struct RowFirst {
  template <class Matrix, class Vector>
  static void subtract(Matrix& p, const Vector& k, const Vector& phi, const Vector& /*weighted*/) {
    p -= k * (phi.transpose() * p);
  }
};

struct RankOne {
  template <class Matrix, class Vector>
  static void subtract(Matrix& p, const Vector& k, const Vector& /*phi*/, const Vector& weighted) {
    p.noalias() -= k * weighted.transpose();
  }
};

/// Only the lower triangle of P is read and written, so it cannot become asymmetric.
template <class Scalar>
struct Triangle {
  using Plain = Dense<Scalar, RankOne>;
  using Vector = typename Plain::Vector;
  using Input = typename Plain::Input;
  static constexpr bool kMakesRegressor = false;

  static Input input(const Sample& sample) { return Plain::input(sample); }
  Prior start(const Settings& settings) {
    theta_.setZero();
    p_ = Plain::Matrix::Identity() * static_cast<Scalar>(settings.variance0);
    lambda_ = static_cast<Scalar>(settings.lambda);
    return {settings.variance0, false};
  }
  void update(const Input& input) {
    auto symmetric = p_.template selfadjointView<Eigen::Lower>();
    const Vector weighted = symmetric * input.phi;
    const Scalar alpha = lambda_ + input.phi.dot(weighted);
    theta_ += weighted * ((input.y - input.phi.dot(theta_)) / alpha);
    symmetric.rankUpdate(weighted, -Scalar(1) / alpha);
    p_ /= lambda_;
  }
  void theta(double* to) const {
    Eigen::Map<Eigen::Matrix<double, kN, 1>>{to} = theta_.template cast<double>();
  }

 private:
  Vector theta_;
  typename Plain::Matrix p_;
  Scalar lambda_;
};

template <class Scalar, class State, void (*kUpdate)(State*, const Scalar*, Scalar),
          void (*kCovariance)(State&, Scalar)>
struct Plain {
  static constexpr bool kMakesRegressor = false;
  struct Input {
    std::array<Scalar, kN> phi;
    Scalar y;
  };

  static Input input(const Sample& sample) {
    Input converted;
    std::transform(sample.phi, sample.phi + kN, converted.phi.begin(),
                   [](double value) { return static_cast<Scalar>(value); });
    converted.y = static_cast<Scalar>(sample.y);
    return converted;
  }
  Prior start(const Settings& settings) {
    state_ = State{};
    state_.lambda = static_cast<Scalar>(settings.lambda);
    kCovariance(state_, static_cast<Scalar>(settings.variance0));
    return {settings.variance0, false};
  }
  void update(const Input& input) { kUpdate(&state_, input.phi.data(), input.y); }
  void theta(double* to) const { std::copy(state_.theta, state_.theta + kN, to); }

 private:
  State state_;
};

template <class Scalar, class State>
void triangle(State& state, Scalar variance) {
  for (int i = 0, at = 0; i < kN; at += kN - i, ++i) {
    state.p[at] = variance;
  }
}

template <class Scalar, class State>
void diagonal(State& state, Scalar variance) {
  std::fill(state.d, state.d + kN, variance);
}

template <class Scalar>
void add_eigen(peers::Entries& entries) {
  const char* scalar = peers::name_of<Scalar>();
  peers::add<Dense<Scalar, LeftToRight>>(entries, "Eigen, (K phi') P", scalar, false);
  peers::add<Dense<Scalar, RowFirst>>(entries, "Eigen, K (phi' P)", scalar, false);
  peers::add<Dense<Scalar, RankOne>>(entries, "Eigen, K (P phi)'", scalar, false);
  peers::add<Triangle<Scalar>>(entries, "Eigen, symmetric rank one", scalar, false);
}

}  // namespace

namespace peers {

template <>
void add_textbook<kN>(Entries& entries) {
  add<Plain<float, ud_float, ud_update_float, diagonal<float, ud_float>>>(entries, "plain C, UD",
                                                                          "float", false);
  add<Plain<double, ud_double, ud_update_double, diagonal<double, ud_double>>>(
      entries, "plain C, UD", "double", false);
  add<Plain<float, symmetric_float, symmetric_update_float, triangle<float, symmetric_float>>>(
      entries, "plain C, symmetric", "float", false);
  add<Plain<double, symmetric_double, symmetric_update_double, triangle<double, symmetric_double>>>(
      entries, "plain C, symmetric", "double", false);
  add_eigen<float>(entries);
  add_eigen<double>(entries);
}

}  // namespace peers
