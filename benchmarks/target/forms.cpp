// SPDX-License-Identifier: MIT
// The form that is measured, EHSID_FORM, for EHSID_N parameters: the recursion with a policy, the textbook's with
// dense matrices, or for six parameters the whole estimator as a controller calls it. One in a translation unit, as in
// a controller: beside others a compiler shares functions that it would inline.
// From n = 8 on Eigen would take its blocked matrix product, which asks for a heap at -Os; not here.
#define EIGEN_CACHEFRIENDLY_PRODUCT_THRESHOLD 16
#include <ehsid/c_api.h>
#include <ehsid/ehsid.hpp>

#include <new>

#include "measured.hpp"

namespace {

using budget::Input;
using budget::kN;
using Vector = ehsid::Vector<float, kN>;
using Matrix = ehsid::SquareMatrix<float, kN>;

template <class Forgetting, class Parts = ehsid::AllParts>
struct Recursion : ehsid::Rls<float, kN, Forgetting, Parts> {
  int update_with(const Input& input) { return static_cast<int>(this->update(input.phi, input.y)); }
};

template <class Forgetting, class Estimator = ehsid::ArxEstimator<float, 3, 3, 1, Forgetting>>
struct Whole : Estimator {
  int update_with(const Input& input) {
    return static_cast<int>(this->step(input.command, input.position));
  }
};

/// The estimator for noise that biases least squares, past their settling before anything is counted.
template <class Estimator>
struct Settled : Estimator {
  Settled() {
    typename Estimator::Options options;
    options.rls.settling = 40;
    static_cast<void>(this->configure(options));
  }
  int update_with(const Input& input) {
    return static_cast<int>(this->step(input.command, input.position));
  }
};

/// K, omega_n and xi, once one start is in charge.
struct Servo : ehsid::ServoEstimator<float> {
  explicit Servo(float dt_s = 0.05F) {
    ehsid::ServoEstimatorOptions<float> options;
    options.dt_s = dt_s;
    static_cast<void>(this->configure(options));
  }
  int update_with(const Input& input) {
    return static_cast<int>(this->step(input.servo_command, input.servo_position));
  }
};

/// While its starts compete, which they do for 1.5 s.
struct ServoStart : Servo {
  ServoStart() : Servo(0.001F) {}
};

/// The monitor of five effects with signatures of 22 sizes; the block ends among the samples that count.
using Growths = ehsid::GrowthMonitor<float, 22, 5>;

constexpr Growths::Tables growth_tables() {
  Growths::Tables made{};
  made.signatures = 22;
  made.tests = 5;
  made.delay = 1;
  made.settle = 20;
  made.block = 400;
  made.gain = 0.015F;
  made.s = 0.06F;
  made.w = 0.17F;
  made.e = 0.71F;
  made.i = 0.4F;
  made.decay = 0.39F;
  made.pull = 0.3F;
  made.correction = {0.6F, 0.3F, 0.1F};
  for (std::size_t n = 0; n < made.command_edges.size(); ++n) {
    made.command_edges[n] = 0.2F * static_cast<float>(n) - 0.6F;
  }
  for (std::size_t n = 0; n < made.acceleration_edges.size(); ++n) {
    made.acceleration_edges[n] = 1e-3F * static_cast<float>(n) - 1.5e-3F;
  }
  for (std::size_t c = 0; c < made.cells.size(); ++c) {
    made.cells[c].weight = 500.0F;
    made.cells[c].other = {0.01F * static_cast<float>(c % 7), 0.2F};
    for (std::size_t n = 0; n < 22; ++n) {
      made.cells[c].signature[n] = 0.01F * static_cast<float>((c + n) % 5) - 0.02F;
    }
  }
  for (std::size_t n = 0; n < 22; ++n) {
    made.effect[n] = static_cast<std::int32_t>(n % 5);
  }
  for (std::size_t n = 0; n < 5; ++n) {
    made.asked[n] = {static_cast<std::int32_t>(n), 0.5F, 0.25F};
  }
  made.prior = 0.01F;
  made.limit = 19.0F;
  return made;
}

constexpr Growths::Tables kGrowthTables = growth_tables();

struct Growing : Growths {
  Growing() { static_cast<void>(configure(kGrowthTables)); }
  int update_with(const Input& input) {
    return static_cast<int>(step(input.servo_command, input.servo_position));
  }
};

/// Eqs. (12)-(14) on a full matrix, as one writes them with Eigen; without any check or guard.
struct Dense {
  Vector theta = Vector::Zero();
  Matrix P = Matrix::Identity() * 1e6F;

  Vector gain(const Input& input) {
    const Vector weighted = P * input.phi;
    const Vector k = weighted / (0.99F + input.phi.dot(weighted));
    theta += k * (input.y - input.phi.dot(theta));
    return k;
  }
};

/// From left to right: K phi' first, then a product of two matrices.
struct AsPrinted : Dense {
  int update_with(const Input& input) {
    const Vector k = gain(input);
    P -= k * input.phi.transpose() * P;
    P /= 0.99F;
    return 0;
  }
};

/// The row phi' P first, so that no step costs more than n^2.
struct Grouped : Dense {
  int update_with(const Input& input) {
    const Vector k = gain(input);
    P -= k * (input.phi.transpose() * P);
    P /= 0.99F;
    return 0;
  }
};

struct Nothing {
  int update_with(const Input& /*input*/) { return 0; }
};

/// A count that is known: the ruler is checked against it.
struct Ruler {
  int update_with(const Input& /*input*/) {
    __asm__ volatile(".rept 1000\n nop\n .endr");
    return 0;
  }
};

namespace forms {
using nothing = Nothing;
using ruler = Ruler;
using as_printed = AsPrinted;
using grouped = Grouped;
#define EHSID_FORMS_OF(policy)                                                       \
  using policy = Recursion<ehsid::PolicyAt<ehsid::place_of_policy(#policy), float>>; \
  using whole_##policy = Whole<ehsid::PolicyAt<ehsid::place_of_policy(#policy), float>>;
EHSID_EACH_POLICY(EHSID_FORMS_OF)
using whole_small = Whole<void, ehsid::SmallArxEstimator<float, 3, 3, 1>>;
using small = Recursion<ehsid::Constant<float>, ehsid::NoParts>;
using whole_riv = Settled<ehsid::InstrumentalArxEstimator<float, 3, 3, 1>>;
using whole_servo = Servo;
using whole_servo_start = ServoStart;
using whole_growth = Growing;

constexpr std::int32_t first(const Servo* /*form*/) { return 1200; }
constexpr std::int32_t first(const ServoStart* /*form*/) { return 400; }
constexpr std::int32_t first(const Growing* /*form*/) { return 800; }
constexpr std::int32_t first(const void* /*form*/) { return 150; }
}  // namespace forms

using Measured = forms::EHSID_FORM;

}  // namespace

extern "C" {
void measured_start(void* storage) { static_cast<void>(::new (storage) Measured()); }
int measured_update(void* storage, const Input& input) {
  return static_cast<Measured*>(storage)->update_with(input);
}
const std::uint32_t measured_bytes = sizeof(Measured);
const std::int32_t measured_first = forms::first(static_cast<Measured*>(nullptr));
}
