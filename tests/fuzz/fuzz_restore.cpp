// SPDX-License-Identifier: MIT
// Bytes into restore(): of every policy, in C, and in C++ in float and double; and of ServoEstimator. A refusal changes nothing; what is
// accepted estimates on, every output is finite, and what it then saves is accepted, too.
//
// An input is: the policy, or precision and age of ServoEstimator; which estimator; how the snapshot is made: the bytes as they are, or a good snapshot with some
// bytes changed; and whether its checksum is made right, so that the checks behind the checksum are reached.
#include "data.hpp"
#include "outputs.hpp"
#include "plant.hpp"
#include "snapshot_checksum.hpp"

#include <ehsid/c_api.h>
#include <ehsid/arx_estimator.hpp>
#include <ehsid/servo_estimator.hpp>

#include <array>
#include <vector>

namespace {

using Snapshot = std::vector<std::uint8_t>;

constexpr int kWarmUp = 200;  // samples before the good snapshot
constexpr int kAfter = 24;    // samples after an accepted one

/// A good snapshot, changed as the input says.
Snapshot changed(fuzz::Data& data, const Snapshot& good) {
  const int how = data.up_to(3);
  Snapshot made;
  if ((how & 1) == 0) {
    made = good;
    while (!data.empty()) {
      const std::size_t place = data.next<std::uint16_t>() % made.size();
      const auto word = data.next<std::uint32_t>();
      for (std::size_t i = 0; i < sizeof word && place + i < made.size(); ++i) {
        made[place + i] = static_cast<std::uint8_t>(word >> (8U * i));
      }
    }
  } else {
    made.assign(data.bytes(), data.bytes() + data.left());
  }
  if ((how & 2) != 0) {
    fuzz::repair_checksum(made);
  }
  return made;
}

/// The snapshot of an estimator that has seen good samples, and the plant then.
struct Good {
  fuzz::Plant plant;
  Snapshot snapshot;
};

template <class Estimator>
Good warmed_up(Estimator estimator, int samples = kWarmUp) {
  Good good;
  for (int k = 0; k < samples; ++k) {
    good.plant.advance();
    static_cast<void>(estimator.step(good.plant.command, good.plant.position));
  }
  good.snapshot = estimator.save();
  return good;
}

/// `estimator`, a new one, has step(), save() and restore() with bytes, and check_outputs().
template <class Estimator>
void run(fuzz::Data& data, Estimator& estimator, const Good& good) {
  fuzz::check(estimator.restore(good.snapshot), "a good snapshot is accepted");
  const Snapshot wanted = changed(data, good.snapshot);
  if (!estimator.restore(wanted)) {
    fuzz::check(estimator.save() == good.snapshot, "a refused snapshot changes nothing");
    return;
  }
  fuzz::check(estimator.save() == wanted, "what was restored is what is saved");
  estimator.check_outputs();
  fuzz::Plant plant = good.plant;
  for (int k = 0; k < kAfter; ++k) {
    plant.advance();
    if (estimator.step(plant.command, plant.position)) {
      estimator.check_outputs();
    }
  }
  fuzz::check(estimator.restore(estimator.save()), "an estimator takes its own snapshot");
}

class InC {
 public:
  explicit InC(const ehsid_kernel* kernel) {
    ehsid_configuration configuration;
    fuzz::check(ehsid_default_configuration(&configuration, kernel, 3, 3, 1, false) == EHSID_OK &&
                    ehsid_init(&estimator_, storage_, sizeof storage_, &configuration) == EHSID_OK,
                "the defaults are accepted");
    most_ = ehsid_snapshot_bytes(kernel);
  }

  InC(const InC&) = delete;  // points into itself
  InC& operator=(const InC&) = delete;

  bool step(float command, float position) {
    return !ehsid_is_error(ehsid_step(estimator_, command, position));
  }
  Snapshot save() const {
    Snapshot saved(most_);
    std::size_t written = 0;
    fuzz::check(ehsid_save(estimator_, saved.data(), saved.size(), &written) == EHSID_OK &&
                    written <= most_,
                "an estimator can be saved");
    saved.resize(written);
    return saved;
  }
  bool restore(const Snapshot& bytes) {
    const void* from =
        bytes.empty() ? estimator_ : static_cast<const void*>(bytes.data());  // not NULL
    ehsid_snapshot_fault fault = EHSID_SNAPSHOT_FITS;
    fuzz::check(ehsid_check_snapshot(estimator_, from, bytes.size(), &fault) == EHSID_OK,
                "any bytes can be checked");
    const bool taken = ehsid_restore(estimator_, from, bytes.size()) == EHSID_OK;
    fuzz::check(taken == (fault == EHSID_SNAPSHOT_FITS), "the check says what restore() does");
    return taken;
  }
  void check_outputs() const { fuzz::check_c_outputs(estimator_); }

 private:
  std::uint64_t storage_[EHSID_STORAGE_WORDS(6)] = {};
  ehsid_estimator* estimator_ = nullptr;
  std::size_t most_ = 0;
};

template <class Estimator>
class InCpp {
 public:
  using Scalar = typename Estimator::Scalar;

  bool step(float command, float position) {
    return !ehsid::is_error(estimator_.step(Scalar(command), Scalar(position)));
  }
  Snapshot save() const {
    Snapshot saved(estimator_.snapshot_bytes());
    estimator_.save(saved.data());
    return saved;
  }
  bool restore(const Snapshot& bytes) {
    const ehsid::SnapshotFault fault = estimator_.check(bytes.data(), bytes.size());
    const bool taken = estimator_.restore(bytes.data(), bytes.size()) == ehsid::Status::ok;
    fuzz::check(taken == (fault == ehsid::SnapshotFault::none),
                "the check says what restore() does");
    return taken;
  }
  void check_outputs() const { fuzz::check_outputs(estimator_); }

 protected:
  Estimator estimator_;
};

template <class Scalar>
class InServo : public InCpp<ehsid::ServoEstimator<Scalar>> {
 public:
  InServo() {
    ehsid::ServoEstimatorOptions<Scalar> options;
    options.dt_s = Scalar(0.01);
    fuzz::check(this->estimator_.configure(options) == ehsid::Status::ok,
                "the defaults are accepted");
  }
  void check_outputs() const {
    const auto told = this->estimator_.servo();
    for (const auto& value : {told.gain, told.omega_n, told.xi}) {
      const bool none = value.value != value.value && value.half_width != value.half_width;
      fuzz::check(none ? !value.trusted
                       : ehsid::is_finite(value.value) && fuzz::is_magnitude(value.half_width),
                  "a value and its interval are finite, or there is none");
      fuzz::check(value.trusted == (value.reason == ehsid::TrustReason::trusted),
                  "what is not trusted has a reason");
    }
    fuzz::check(this->estimator_.resets() >= 0, "resets are counted from 0 on");
  }
};

#define FUZZ_KERNEL(policy) EHSID_KERNEL(policy, 6),
const ehsid_kernel* const kKernels[] = {EHSID_EACH_POLICY(FUZZ_KERNEL)};
#undef FUZZ_KERNEL

template <class Scalar, std::size_t kPlace>
void run_cpp(fuzz::Data& data) {
  using Estimator = InCpp<ehsid::ArxEstimator<Scalar, 3, 3, 1, ehsid::PolicyAt<kPlace, Scalar>>>;
  static const Good kGood = warmed_up(Estimator{});
  Estimator estimator;
  run(data, estimator, kGood);
}

/// Saved while its starts compete, or long after.
template <class Scalar>
void run_servo(fuzz::Data& data, bool late) {
  static const std::array<Good, 2> kGood{warmed_up(InServo<Scalar>{}),
                                         warmed_up(InServo<Scalar>{}, 10 * kWarmUp)};
  InServo<Scalar> estimator;
  run(data, estimator, kGood[late ? 1 : 0]);
}

}  // namespace

int LLVMFuzzerTestOneInput(const std::uint8_t* bytes, std::size_t count) {
  fuzz::Data data(bytes, count);
  const auto policy = static_cast<std::size_t>(data.up_to(ehsid::kPolicies - 1));
  const int which = data.up_to(3);
  if (which == 3) {
    policy % 2 == 0 ? run_servo<float>(data, policy > 1) : run_servo<double>(data, policy > 1);
    return 0;
  }
  if (which == 0) {
    static const std::vector<Good> kGood = [] {
      std::vector<Good> made;
      for (const ehsid_kernel* kernel : kKernels) {
        made.push_back(warmed_up(InC(kernel)));
      }
      return made;
    }();
    InC estimator(kKernels[policy]);
    run(data, estimator, kGood[policy]);
    return 0;
  }
  ehsid::for_each_policy([&](auto place) {
    if (place.value == policy) {
      which == 1 ? run_cpp<float, place.value>(data) : run_cpp<double, place.value>(data);
    }
  });
  return 0;
}
