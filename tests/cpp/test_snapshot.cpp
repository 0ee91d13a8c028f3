// SPDX-License-Identifier: MIT
// Every snapshot that is not exactly what an estimator with the same model and configuration saved is refused, and
// nothing has changed then. For every policy, in float and double.
#include <ehsid/arx_estimator.hpp>

#include <cmath>
#include <limits>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

namespace {

using ehsid::SnapshotFault;
using ehsid::Status;

// Where the header has what, see docs/linking.md.
constexpr std::size_t kVersionAt = 4;
constexpr std::size_t kStateAt = 26;

// Sanitizers make a step twenty times as long. There, of what is tried for every bit and place, these must do.
#if defined(EHSID_FEWER)
constexpr std::size_t kEvery = 13;
#else
constexpr std::size_t kEvery = 1;
#endif

/// A precision and a policy: what each test is made for.
template <class Number, std::size_t kPlace>
struct Kind {
  using Scalar = Number;
  using Policy = ehsid::PolicyAt<kPlace, Scalar>;
  template <int kNa, int kNb, bool kOffset = false>
  using Servo = ehsid::ArxEstimator<Scalar, kNa, kNb, 1, Policy, kOffset>;
};

/// A plant with a change and a hold, so that windows, counters and reset have something to remember.
class Plant {
 public:
  explicit Plant(std::uint32_t seed) : random_(seed) {}

  template <class Estimator>
  Status step(Estimator& estimator) {
    using Scalar = typename Estimator::Scalar;
    random_ = random_ * 1664525U + 1013904223U;  // Numerical Recipes' generator
    const bool held = k_ > 150 && k_ < 200;
    const double command = held ? 0.5 : static_cast<double>(random_ >> 8U) / 8388608.0 - 1.0;
    position_ = 0.9 * position_ + (k_ < 300 ? 0.2 : 0.5) * command;
    ++k_;
    return estimator.step(static_cast<Scalar>(command), static_cast<Scalar>(position_));
  }

 private:
  std::uint32_t random_;
  double position_ = 0.0;
  int k_ = 0;
};

template <class Estimator>
Estimator after(int samples, const typename Estimator::Options& options = {}) {
  Estimator estimator;
  EXPECT_EQ(estimator.configure(options), Status::ok);
  Plant plant(7);
  for (int k = 0; k < samples; ++k) {
    static_cast<void>(plant.step(estimator));
  }
  return estimator;
}

using Bytes = std::vector<std::uint8_t>;

template <class Estimator>
Bytes saved(const Estimator& estimator) {
  Bytes bytes(estimator.snapshot_bytes());
  estimator.save(bytes.data());
  return bytes;
}

/// The same with the checksum that belongs to the bytes: what only someone who wants to can make.
Bytes forged(Bytes bytes) {
  ehsid::Crc32 crc;
  for (std::size_t i = 0; i + 4 < bytes.size(); ++i) {
    crc.add(bytes[i]);
  }
  for (std::size_t i = 0; i < 4; ++i) {
    bytes[bytes.size() - 4 + i] = static_cast<std::uint8_t>(crc.value() >> 8U * i);
  }
  return bytes;
}

/// Why the bytes are refused; `none` where they are not, or where any byte of the estimator has changed, padding included.
template <class Estimator>
SnapshotFault refusal(Estimator& estimator, const Bytes& bytes) {
  std::array<unsigned char, sizeof(Estimator)> before;
  std::memcpy(before.data(), &estimator, sizeof estimator);
  const SnapshotFault fault = estimator.check(bytes.data(), bytes.size());
  const bool good = estimator.restore(bytes.data(), bytes.size()) == Status::invalid_argument &&
                    std::memcmp(before.data(), &estimator, sizeof estimator) == 0;
  return good ? fault : SnapshotFault::none;
}

template <class Estimator>
bool refused(Estimator& estimator, const Bytes& bytes, SnapshotFault fault) {
  return refusal(estimator, bytes) == fault;
}

template <class Estimator>
void flip_every_bit() {
  auto estimator = after<Estimator>(320);
  Bytes bytes = saved(after<Estimator>(250));
  std::size_t accepted = 0;
  for (std::size_t bit = 0; bit < 8 * bytes.size(); bit += kEvery) {
    const auto mask = static_cast<std::uint8_t>(1U << bit % 8);
    bytes[bit / 8] = static_cast<std::uint8_t>(bytes[bit / 8] ^ mask);
    accepted += refusal(estimator, bytes) == SnapshotFault::none ? 1 : 0;
    bytes[bit / 8] = static_cast<std::uint8_t>(bytes[bit / 8] ^ mask);
  }
  EXPECT_EQ(accepted, 0U) << "of " << 8 * bytes.size() / kEvery;
  EXPECT_EQ(estimator.restore(bytes.data(), bytes.size()), Status::ok);
}

template <class Estimator>
void change_every_length() {
  auto estimator = after<Estimator>(320);
  const Bytes bytes = saved(after<Estimator>(250));
  for (std::size_t length = 0; length < bytes.size(); ++length) {
    const auto end = bytes.begin() + static_cast<std::ptrdiff_t>(length);
    ASSERT_TRUE(refused(estimator, Bytes(bytes.begin(), end),
                        length < 6 ? SnapshotFault::not_a_snapshot : SnapshotFault::damaged))
        << length;
  }
  Bytes longer = bytes;
  longer.push_back(0);
  EXPECT_TRUE(refused(estimator, longer, SnapshotFault::damaged));
  EXPECT_TRUE(refused(estimator, forged(longer), SnapshotFault::damaged));
}

template <class Estimator>
void continue_bit_for_bit() {
  for (const int cut : {0, 1, 5, 100, 180, 305, 350}) {
    SCOPED_TRACE(cut);
    Plant plant(static_cast<std::uint32_t>(cut));
    Estimator first;
    for (int k = 0; k < cut; ++k) {
      static_cast<void>(plant.step(first));
    }
    first.enable(cut % 2 == 0);
    auto second = after<Estimator>(77);
    ASSERT_EQ(second.restore(first.save()), Status::ok);
    ASSERT_EQ(second.save(), first.save());
    first.enable(true);
    second.enable(true);
    Plant same = plant;
    for (int k = 0; k < 400; ++k) {
      ASSERT_EQ(plant.step(first), same.step(second));
    }
    EXPECT_EQ(second.save(), first.save());
  }
}

template <class Kind>
struct Snapshot : testing::Test {};

template <std::size_t... kPlaces>
testing::Types<Kind<float, kPlaces>..., Kind<double, kPlaces>...> every_kind(
    std::index_sequence<kPlaces...>);
using Kinds = decltype(every_kind(std::make_index_sequence<ehsid::kPolicies>{}));
TYPED_TEST_SUITE(Snapshot, Kinds, );

TYPED_TEST(Snapshot, WithOneBitFlippedIsRefused) {
  flip_every_bit<typename TypeParam::template Servo<1, 1>>();
  flip_every_bit<typename TypeParam::template Servo<3, 3>>();
  flip_every_bit<typename TypeParam::template Servo<6, 6, true>>();
}

TYPED_TEST(Snapshot, OfAnotherLengthIsRefused) {
  change_every_length<typename TypeParam::template Servo<1, 1>>();
  change_every_length<typename TypeParam::template Servo<3, 3>>();
  change_every_length<typename TypeParam::template Servo<6, 6, true>>();
}

TYPED_TEST(Snapshot, ContinuesBitForBit) {
  continue_bit_for_bit<typename TypeParam::template Servo<1, 1>>();
  continue_bit_for_bit<typename TypeParam::template Servo<3, 3>>();
  continue_bit_for_bit<typename TypeParam::template Servo<6, 6, true>>();
}

TYPED_TEST(Snapshot, OfAnotherVersionIsRefused) {
  auto estimator = after<typename TypeParam::template Servo<3, 3>>(320);
  Bytes bytes = saved(estimator);
  for (const int version : {0, 1, 2, 3, 5, 255}) {
    bytes[kVersionAt] = static_cast<std::uint8_t>(version);
    EXPECT_TRUE(refused(estimator, bytes, SnapshotFault::other_version));
    EXPECT_TRUE(refused(estimator, forged(bytes), SnapshotFault::other_version));
  }
}

TYPED_TEST(Snapshot, OfAnotherModelIsRefused) {
  using Scalar = typename TypeParam::Scalar;
  auto estimator = after<typename TypeParam::template Servo<3, 3>>(320);
  const auto other = [&](const Bytes& bytes) {
    return refused(estimator, bytes, SnapshotFault::other_model);
  };
  EXPECT_TRUE(other(saved(after<typename TypeParam::template Servo<2, 4>>(320))));
  EXPECT_TRUE(other(saved(after<typename TypeParam::template Servo<3, 2, true>>(320))));
  using Policy = typename TypeParam::Policy;
  using Delayed = ehsid::ArxEstimator<Scalar, 3, 3, 2, Policy>;
  EXPECT_TRUE(other(saved(after<Delayed>(320))));
  using Precision = std::conditional_t<std::is_same_v<Scalar, float>, double, float>;
  ehsid::for_each_policy([&](auto place) {
    using Same = ehsid::ArxEstimator<Scalar, 3, 3, 1, ehsid::PolicyAt<place, Scalar>>;
    using Wrong = ehsid::ArxEstimator<Precision, 3, 3, 1, ehsid::PolicyAt<place, Precision>>;
    EXPECT_TRUE(other(saved(after<Wrong>(320))));
    if (place.value + 1 != Policy::kId) {
      EXPECT_TRUE(other(saved(after<Same>(320))));
    }
  });
}

/// Another value of the same range.
template <class Scalar>
void alter(Scalar& setting) {
  setting = setting * Scalar(0.875) + Scalar(0.09375);
}

TYPED_TEST(Snapshot, OfAnotherConfigurationIsRefused) {
  using Scalar = typename TypeParam::Scalar;
  using Servo = typename TypeParam::template Servo<3, 3>;
  using Options = typename Servo::Options;
  auto estimator = after<Servo>(320);
  int changed = 0;
  const auto other = [&](auto change) {
    ++changed;
    Options options;
    change(options);
    EXPECT_TRUE(options.valid()) << changed;
    EXPECT_TRUE(
        refused(estimator, saved(after<Servo>(5, options)), SnapshotFault::other_configuration))
        << changed;
  };
  other([](Options& o) { o.scaling.command_scale = Scalar(2); });
  other([](Options& o) { o.scaling.position_scale = Scalar(2); });
  other([](Options& o) { o.scaling.command_offset = Scalar(2); });
  other([](Options& o) { o.scaling.position_offset = Scalar(2); });
  other([](Options& o) { o.rls.information_margin = Scalar(0.5); });
  other([](Options& o) { o.rls.covariance_ceiling = Scalar(2); });
  other([](Options& o) { o.reset_enabled = false; });
  other([](Options& o) { o.reset.short_window = Scalar(11); });
  other([](Options& o) { o.reset.long_window = Scalar(201); });
  other([](Options& o) { o.reset.trigger_ratio = Scalar(4); });
  other([](Options& o) { o.reset.release_ratio = Scalar(1.25); });
  other([](Options& o) { o.reset.cool_down = 51; });
  other([](Options& o) { o.reset.floor = Scalar(1e-4); });
  other([](Options& o) { o.convergence.tolerance = Scalar(0.1); });
  other([](Options& o) { o.convergence.magnitude = Scalar(0.2); });
  other([](Options& o) { o.convergence.hold = 21; });
  other([](Options& o) { o.input_limit = Scalar(100); });
  for (int i = 0; i < 6; ++i) {
    other([i](Options& o) { o.variance0[i] = Scalar(100); });
  }
  using Policy = typename TypeParam::Policy;
  Policy::settings([&](const ehsid::SettingInfo& setting, auto member) {
    SCOPED_TRACE(setting.name);
    other([&](Options& o) {
      alter(member(o.forgetting));
      o.forgetting.restart();
    });
  });
}

TYPED_TEST(Snapshot, TakesOverWhereOnlyWhatNoLongerMattersDiffers) {
  using Servo = typename TypeParam::template Servo<3, 3>;
  typename Servo::Options options;
  options.theta0.setOnes();
  auto estimator = after<Servo>(10, options);
  const auto other = after<Servo>(320);
  EXPECT_EQ(estimator.restore(other.save()), Status::ok);
  // The windows of a reset that is switched off.
  typename Servo::Options off;
  off.reset_enabled = false;
  estimator = after<Servo>(10, off);
  off.reset.long_window *= 2;
  EXPECT_EQ(estimator.restore(after<Servo>(320, off).save()), Status::ok);
}

TYPED_TEST(Snapshot, DoesNotDependOnMemoryThatNobodyWrote) {
  using Servo = typename TypeParam::template Servo<6, 6, true>;
  std::vector<Bytes> made;
  for (const int memory : {0x00, 0xFF, 0xA5}) {
    alignas(Servo) unsigned char storage[sizeof(Servo)];
    std::memset(storage, memory, sizeof storage);
    // Without parentheses: value-initialisation would clear what the constructor leaves.
    auto* estimator = ::new (static_cast<void*>(storage)) Servo;
    Plant plant(3);
    for (int k = 0; k < 320; ++k) {
      static_cast<void>(plant.step(*estimator));
    }
    Bytes bytes(estimator->snapshot_bytes(), static_cast<std::uint8_t>(memory));
    estimator->save(bytes.data());
    made.push_back(bytes);
  }
  EXPECT_EQ(made[1], made[0]);
  EXPECT_EQ(made[2], made[0]);
}

/// No state, however it was made, brings a number that is not finite.
TYPED_TEST(Snapshot, WithARightChecksumBringsNothingButFiniteNumbers) {
  using Scalar = typename TypeParam::Scalar;
  using Servo = typename TypeParam::template Servo<3, 3>;
  using Word = typename ehsid::Bits<Scalar>::Word;
  const auto good = after<Servo>(320);
  const Bytes bytes = saved(good);
  std::vector<Word> patterns{
      ehsid::bits_of(std::numeric_limits<Scalar>::quiet_NaN()),
      ehsid::bits_of(std::numeric_limits<Scalar>::infinity()),
      ehsid::bits_of(-std::numeric_limits<Scalar>::infinity()),
      ehsid::bits_of(std::numeric_limits<Scalar>::max()),
      ehsid::bits_of(-std::numeric_limits<Scalar>::max()),
      ehsid::bits_of(std::numeric_limits<Scalar>::denorm_min()),
      static_cast<Word>(~Word{0}),
      static_cast<Word>(0x7FFFFFFF),
      Word{1000000},
      Word{0},
  };
  int taken = 0;
  int impossible = 0;
  for (const Word pattern : patterns) {
    for (std::size_t at = kStateAt; at + sizeof pattern + 4 <= bytes.size(); at += kEvery) {
      Bytes changed = bytes;
      for (std::size_t i = 0; i < sizeof pattern; ++i) {
        changed[at + i] = static_cast<std::uint8_t>(pattern >> 8U * i);
      }
      changed = forged(changed);
      auto estimator = good;
      if (estimator.restore(changed.data(), changed.size()) != Status::ok) {
        ASSERT_TRUE(refused(estimator, changed, SnapshotFault::impossible));
        ++impossible;
        continue;
      }
      ++taken;
      Plant plant(1);
      for (int k = 0; k < 20; ++k) {
        ASSERT_TRUE(ehsid::all_finite<6>(estimator.theta_hat())) << at;
        ASSERT_TRUE(ehsid::all_finite<6>(estimator.standard_deviation())) << at;
        ASSERT_TRUE(ehsid::is_finite(estimator.innovation())) << at;
        ASSERT_TRUE(ehsid::is_finite(estimator.forgetting_factor())) << at;
        ASSERT_TRUE(ehsid::is_finite(estimator.residual_variance())) << at;
        static_cast<void>(plant.step(estimator));
      }
    }
  }
  EXPECT_GT(taken, 0);
  EXPECT_GT(impossible, 0);
}

TEST(SnapshotOfFRatio, TellsWindowsOfTheSameTotalLengthApart) {
  using One = ehsid::ArxEstimator<float, 3, 3, 1, ehsid::FRatio<float, 10, 100>>;
  using Other = ehsid::ArxEstimator<float, 3, 3, 1, ehsid::FRatio<float, 20, 90>>;
  One estimator;
  EXPECT_TRUE(refused(estimator, saved(Other{}), SnapshotFault::other_configuration));
}

}  // namespace
