// SPDX-License-Identifier: MIT
// Nothing in the life of an estimator allocates: malloc and its kin are wrapped by the linker (see
// CMakeLists.txt), operator new is replaced, and both count.
#include <ehsid/ehsid.hpp>

#include <gtest/gtest.h>

#include <cstdlib>
#include <limits>
#include <new>
#include <random>

namespace {
// volatile: compilers know malloc and new, and would otherwise take the count for unchanged by them.
volatile int allocations = 0;
}  // namespace

// The names are the linker's.
// NOLINTBEGIN(bugprone-reserved-identifier, readability-inconsistent-declaration-parameter-name)
extern "C" {
void* __real_malloc(std::size_t size);
void* __real_calloc(std::size_t count, std::size_t size);
void* __real_realloc(void* memory, std::size_t size);
void* __real_aligned_alloc(std::size_t alignment, std::size_t size);
int __real_posix_memalign(void** memory, std::size_t alignment, std::size_t size);

void* __wrap_malloc(std::size_t size) {
  allocations = allocations + 1;
  return __real_malloc(size);
}
void* __wrap_calloc(std::size_t count, std::size_t size) {
  allocations = allocations + 1;
  return __real_calloc(count, size);
}
void* __wrap_realloc(void* memory, std::size_t size) {
  allocations = allocations + 1;
  return __real_realloc(memory, size);
}
void* __wrap_aligned_alloc(std::size_t alignment, std::size_t size) {
  allocations = allocations + 1;
  return __real_aligned_alloc(alignment, size);
}
int __wrap_posix_memalign(void** memory, std::size_t alignment, std::size_t size) {
  allocations = allocations + 1;
  return __real_posix_memalign(memory, alignment, size);
}
}
// NOLINTEND(bugprone-reserved-identifier, readability-inconsistent-declaration-parameter-name)

// Not inline: gcc would otherwise take new and free for a mismatched pair.
[[gnu::noinline]] void* operator new(std::size_t size) {
  if (void* memory = std::malloc(size)) {
    return memory;
  }
  throw std::bad_alloc();
}
[[gnu::noinline]] void* operator new(std::size_t size, const std::nothrow_t& /*tag*/) noexcept {
  return std::malloc(size);
}
[[gnu::noinline]] void operator delete(void* memory) noexcept { std::free(memory); }
[[gnu::noinline]] void operator delete(void* memory, std::size_t) noexcept { std::free(memory); }

namespace {

template <class Estimator>
class NoHeap : public testing::Test {};

template <class Scalar, class Forgetting>
using Servo = ehsid::ArxEstimator<Scalar, 3, 3, 1, Forgetting>;

template <class Floats, class Doubles>
struct Both;
template <class... Float, class... Double>
struct Both<std::tuple<Float...>, std::tuple<Double...>> {
  using Types = testing::Types<Servo<float, Float>..., Servo<double, Double>...>;
};
using Estimators = Both<ehsid::Policies<float>, ehsid::Policies<double>>::Types;
TYPED_TEST_SUITE(NoHeap, Estimators, );

TYPED_TEST(NoHeap, WholeLifeOfAnEstimator) {
  using Scalar = typename TypeParam::Scalar;
  std::minstd_rand random(7);
  const int before = allocations;

  TypeParam estimator;
  typename TypeParam::Options options;
  options.theta0.setConstant(Scalar(0.1));
  ehsid::Status status = estimator.configure(options);
  int estimated = 0;
  Scalar y(0);
  for (int k = 0; k < 2000; ++k) {
    const Scalar u = random() % 2 == 0 ? Scalar(1) : Scalar(-1);
    status = estimator.step(u, y);
    estimated += status == ehsid::Status::ok ? 1 : 0;
    y = Scalar(0.9) * y + (k < 1000 ? Scalar(0.1) : Scalar(0.5)) * u;  // the plant changes half-way
  }
  status = estimator.step(std::numeric_limits<Scalar>::quiet_NaN(), y);
  const bool refused = status == ehsid::Status::invalid_input;
  const typename TypeParam::Snapshot saved = estimator.save();
  estimator.reset();
  estimator.enable(false);
  const bool seeded = estimator.seed(estimator.theta_hat(), estimator.recursion().state().factors,
                                     Scalar(1)) == ehsid::Status::ok;
  status = estimator.restore(saved);
  const Scalar sum = estimator.theta_hat().sum() + estimator.standard_deviation().sum() +
                     estimator.covariance().sum() + estimator.recursion().P().sum();
  const int allocated = allocations - before;

  EXPECT_EQ(allocated, 0);
  // ... and the work was done.
  EXPECT_GT(estimated, 100);
  EXPECT_TRUE(refused);
  EXPECT_TRUE(seeded);
  EXPECT_EQ(status, ehsid::Status::ok);
  EXPECT_TRUE(ehsid::is_finite(sum));
}

template <class Estimator>
class NoHeapOfGradients : public testing::Test {};
using GradientEstimators = testing::Types<ehsid::InstrumentalArxEstimator<float, 3, 3, 1>,
                                          ehsid::InstrumentalArxEstimator<double, 3, 3, 1>>;
TYPED_TEST_SUITE(NoHeapOfGradients, GradientEstimators, );

TYPED_TEST(NoHeapOfGradients, WholeLifeOfAnEstimator) {
  using Scalar = typename TypeParam::Scalar;
  std::minstd_rand random(7);
  const int before = allocations;

  TypeParam estimator;
  int estimated = 0;
  Scalar y(0);
  for (int k = 0; k < 2000; ++k) {
    const Scalar u = random() % 2 == 0 ? Scalar(1) : Scalar(-1);
    estimated += estimator.step(u, y) == ehsid::Status::ok ? 1 : 0;
    const Scalar noise = random() % 2 == 0 ? Scalar(0.01) : Scalar(-0.01);
    y = Scalar(0.9) * y + Scalar(0.1) * u + noise;
  }
  const typename TypeParam::Snapshot saved = estimator.save();
  estimator.reset();
  estimator.enable(false);
  const ehsid::Status status = estimator.restore(saved);
  const Scalar sum = estimator.theta_hat().sum() + estimator.standard_deviation().sum() +
                     estimator.covariance().sum();
  const int allocated = allocations - before;

  EXPECT_EQ(allocated, 0);
  EXPECT_GT(estimated, 100);
  EXPECT_EQ(status, ehsid::Status::ok);
  EXPECT_TRUE(ehsid::is_finite(sum));
}

template <class Scalar>
class NoHeapOfServo : public testing::Test {};
using Scalars = testing::Types<float, double>;
TYPED_TEST_SUITE(NoHeapOfServo, Scalars, );

TYPED_TEST(NoHeapOfServo, WholeLifeOfAServoEstimator) {
  using Scalar = TypeParam;
  std::minstd_rand random(7);
  const int before = allocations;

  ehsid::ServoEstimator<Scalar> estimator;
  typename ehsid::ServoEstimator<Scalar>::Options options;
  options.dt_s = Scalar(0.01);
  ehsid::Status status = estimator.configure(options);
  int tracked = 0;
  bool trusted = false;
  Scalar velocity(0);
  Scalar y(0);
  Scalar u(1);
  for (int k = 0; k < 4000; ++k) {
    u = k % 20 != 0 ? u : random() % 2 == 0 ? Scalar(1) : Scalar(-1);
    u = k > 3000 ? Scalar(0) : u;  // a rest
    status = estimator.step(u, y);
    tracked += status == ehsid::Status::ok ? 1 : 0;
    trusted = trusted || estimator.servo().gain.trusted;
    velocity += Scalar(0.2) * (Scalar(0.001) * u - velocity);
    y += velocity;
  }
  const bool rested = estimator.resting();
  status = estimator.step(std::numeric_limits<Scalar>::quiet_NaN(), y);
  const int allocated = allocations - before;

  EXPECT_EQ(allocated, 0);
  EXPECT_GT(tracked, 2000);
  EXPECT_TRUE(trusted);
  EXPECT_TRUE(rested);
  EXPECT_EQ(status, ehsid::Status::invalid_input);
}

TEST(NoHeapCounter, CountsWhatItIsMeantToCount) {
  const int before = allocations;
  void* volatile from_malloc = std::malloc(8);
  EXPECT_EQ(allocations, before + 1);
  int* volatile from_new = new int(1);
  EXPECT_EQ(allocations, before + 2);
  Eigen::VectorXf* volatile from_eigen = new Eigen::VectorXf(100);
  EXPECT_EQ(allocations, before + 4);
  std::free(from_malloc);
  delete from_new;
  delete from_eigen;
}

}  // namespace
