// SPDX-License-Identifier: MIT
// Every form that is measured, for EHSID_N parameters: the recursion with each policy, the textbook's with dense
// matrices, and for six parameters the whole estimator as a controller calls it.
// From n = 8 on Eigen would take its blocked matrix product, which asks for a heap at -Os; not here.
#define EIGEN_CACHEFRIENDLY_PRODUCT_THRESHOLD 16
#include <ehsid/ehsid.hpp>

#include <new>

#include "measured.hpp"

namespace {

using budget::Input;
using budget::kN;
using Vector = ehsid::Vector<float, kN>;
using Matrix = ehsid::SquareMatrix<float, kN>;

template <class Forgetting>
struct Recursion : ehsid::Rls<float, kN, Forgetting> {
  int update_with(const Input& input) { return static_cast<int>(this->update(input.phi, input.y)); }
};

template <class Forgetting>
struct Whole : ehsid::ServoEstimator<float, 3, 3, 1, Forgetting> {
  int update_with(const Input& input) {
    return static_cast<int>(this->step(input.command, input.position));
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

}  // namespace

#define EHSID_FORM(name, ...)                                           \
  extern "C" void start_##name(void* storage) {                         \
    static_cast<void>(::new (storage) __VA_ARGS__());                   \
  }                                                                     \
  extern "C" int update_##name(void* storage, const Input& input) {     \
    return static_cast<__VA_ARGS__*>(storage)->update_with(input);      \
  }                                                                     \
  extern "C" {                                                          \
  extern const std::uint32_t bytes_##name;                              \
  [[gnu::used]] const std::uint32_t bytes_##name = sizeof(__VA_ARGS__); \
  }

EHSID_FORM(nothing, Nothing)
EHSID_FORM(ruler, Ruler)
EHSID_FORM(as_printed, AsPrinted)
EHSID_FORM(grouped, Grouped)
EHSID_FORM(constant, Recursion<ehsid::Constant<float>>)
EHSID_FORM(exponential, Recursion<ehsid::Exponential<float>>)
EHSID_FORM(error_driven, Recursion<ehsid::ErrorDriven<float>>)
EHSID_FORM(f_ratio, Recursion<ehsid::FRatio<float>>)
EHSID_FORM(directional, Recursion<ehsid::Directional<float>>)
EHSID_FORM(random_walk, Recursion<ehsid::RandomWalk<float, kN>>)
#if EHSID_N == 6
EHSID_FORM(whole_constant, Whole<ehsid::Constant<float>>)
EHSID_FORM(whole_exponential, Whole<ehsid::Exponential<float>>)
EHSID_FORM(whole_error_driven, Whole<ehsid::ErrorDriven<float>>)
EHSID_FORM(whole_f_ratio, Whole<ehsid::FRatio<float>>)
EHSID_FORM(whole_directional, Whole<ehsid::Directional<float>>)
EHSID_FORM(whole_random_walk, Whole<ehsid::RandomWalk<float, 6>>)
#endif
