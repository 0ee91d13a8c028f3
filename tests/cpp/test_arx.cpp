// SPDX-License-Identifier: MIT
// The regressor against Eq. (8) written out on the whole record.
#include <ehsid/arx.hpp>

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <limits>
#include <random>

namespace {

constexpr int kSamples = 60;

template <class Model>
class ArxOrders : public testing::Test {
 protected:
  ArxOrders() {
    std::mt19937 random(3);
    std::normal_distribution<double> normal;
    for (int k = 0; k < kSamples; ++k) {
      u[static_cast<std::size_t>(k)] = normal(random);
      y[static_cast<std::size_t>(k)] = normal(random);
    }
    for (int i = 0; i < Model::kN; ++i) {
      theta[i] = normal(random) / Model::kN;
    }
  }

  /// Entry i of phi(k), Eq. (8).
  double expected(int k, int i) const {
    if (i < Model::kNa) {
      return -y[static_cast<std::size_t>(k - 1 - i)];
    }
    if (i < Model::kNa + Model::kNb) {
      return u[static_cast<std::size_t>(k - Model::kNk - (i - Model::kNa))];
    }
    return 1.0;
  }

  void advance(Model& model, int k) const {
    model.advance_command(u[static_cast<std::size_t>(k)]);
    model.advance_output(y[static_cast<std::size_t>(k)]);
  }

  std::array<double, kSamples> u{};
  std::array<double, kSamples> y{};
  typename Model::Parameters theta;
};

using Models = testing::Types<ehsid::Arx<double, 1, 1, 0>, ehsid::Arx<double, 1, 1, 1>,
                              ehsid::Arx<double, 3, 3, 1>, ehsid::Arx<double, 3, 3, 1, true>,
                              ehsid::Arx<double, 4, 1, 1>, ehsid::Arx<double, 2, 5, 0, true>,
                              ehsid::Arx<double, 6, 6, 20, true>>;
TYPED_TEST_SUITE(ArxOrders, Models, );

TYPED_TEST(ArxOrders, RegressorIsEquation8OnceTheHistoryIsFull) {
  TypeParam model;
  const int first = std::max(TypeParam::kNa, TypeParam::kNk + TypeParam::kNb - 1);
  for (int k = 0; k < kSamples; ++k) {
    model.advance_command(this->u[static_cast<std::size_t>(k)]);
    ASSERT_EQ(model.ready(), k >= first) << "at sample " << k;
    if (model.ready()) {
      const auto phi = model.regressor();
      double predicted = 0.0;
      for (int i = 0; i < TypeParam::kN; ++i) {
        ASSERT_EQ(phi[i], this->expected(k, i)) << "at sample " << k << ", entry " << i;
        predicted += phi[i] * this->theta[i];
      }
      EXPECT_NEAR(model.predict(this->theta), predicted, 1e-14);
    }
    model.advance_output(this->y[static_cast<std::size_t>(k)]);
  }
}

TYPED_TEST(ArxOrders, AheadPredictionIsTheDifferenceEquationOnItsOwnOutputs) {
  constexpr int kSteps = 8;
  const int last = kSamples - kSteps - 1;
  TypeParam model;
  for (int k = 0; k <= last; ++k) {
    this->advance(model, k);
  }
  ehsid::Vector<double, kSteps> commands;
  for (int i = 0; i < kSteps; ++i) {
    commands[i] = this->u[static_cast<std::size_t>(last + 1 + i)];
  }
  const auto state = model.state();
  const auto ahead = model.template predict_ahead<kSteps>(this->theta, commands);
  EXPECT_EQ(model.state().outputs, state.outputs);
  for (int i = 0; i < kSteps; ++i) {
    double sum = 0.0;
    for (int j = 0; j < TypeParam::kN; ++j) {
      sum += this->theta[j] * this->expected(last + 1 + i, j);
    }
    EXPECT_NEAR(ahead[i], sum, 1e-13);
    this->y[static_cast<std::size_t>(last + 1 + i)] = sum;  // takes the measurement's place
  }
}

TYPED_TEST(ArxOrders, ClearedHistoryFillsAnew) {
  TypeParam model;
  for (int k = 0; k < kSamples; ++k) {
    this->advance(model, k);
  }
  model.clear();
  EXPECT_FALSE(model.ready());
  for (int k = 0; k < TypeParam::kFull; ++k) {
    EXPECT_FALSE(model.ready());
    this->advance(model, k);
  }
  EXPECT_TRUE(model.ready());
}

TYPED_TEST(ArxOrders, UnusableStateIsRefusedAndChangesNothing) {
  TypeParam model;
  this->advance(model, 0);
  auto broken = model.state();
  broken.filled = TypeParam::kFull + 1;
  EXPECT_EQ(model.restore(broken), ehsid::Status::invalid_argument);
  broken = model.state();
  broken.outputs[0] = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(model.restore(broken), ehsid::Status::invalid_argument);
  EXPECT_EQ(model.state().outputs[0], this->y[0]);
  EXPECT_EQ(model.restore(model.state()), ehsid::Status::ok);
}

TEST(Arx, PredictionsOfAnUnstableModelStayFinite) {
  ehsid::Arx<float, 2, 1, 1> model;
  for (int k = 0; k < 3; ++k) {
    model.advance_command(1e4F);
    model.advance_output(k % 2 == 0 ? 1e4F : -1e4F);
  }
  const ehsid::Vector<float, 3> theta(9e18F, 9e18F, 9e18F);
  const auto ahead = model.predict_ahead<8>(theta, ehsid::Vector<float, 8>::Constant(-1e4F));
  EXPECT_TRUE(ehsid::all_finite<8>(ahead));
}

}  // namespace
