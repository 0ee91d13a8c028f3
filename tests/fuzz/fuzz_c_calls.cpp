// SPDX-License-Identifier: MIT
// Sequences of calls of the C API with arguments of any kind: no pointer, too few bytes, storage that is not aligned,
// settings and samples of any bits, several estimators. No call reads or writes where it may not (the sanitizers look),
// a refusal changes nothing, and outputs are finite.
#include "data.hpp"
#include "outputs.hpp"
#include "plant.hpp"

#include <algorithm>
#include <array>
#include <memory>
#include <vector>

namespace {

constexpr int kEstimators = 3;
constexpr int kMostCalls = 64;

constexpr int kSizes[] = {2, 6, 7, 13};  // those in kernels.cpp.in
#define FUZZ_KERNELS(policy)                                                 \
  EHSID_KERNEL(policy, 2), EHSID_KERNEL(policy, 6), EHSID_KERNEL(policy, 7), \
      EHSID_KERNEL(policy, 13),
const ehsid_kernel* const kKernels[] = {EHSID_EACH_POLICY(FUZZ_KERNELS)};
#undef FUZZ_KERNELS
constexpr int kKernelCount = sizeof kKernels / sizeof kKernels[0];

/// An estimator and its storage, of exactly the size that was told: beyond it the address sanitizer looks.
struct Place {
  std::unique_ptr<std::uint8_t[]> storage;  // from new: aligned to 8 bytes and more
  std::size_t bytes = 0;
  ehsid_estimator* estimator = nullptr;
  fuzz::Plant plant;

  std::vector<std::uint8_t> copy() const { return {storage.get(), storage.get() + bytes}; }
};

using Places = std::array<Place, kEstimators>;

void change_settings(fuzz::Data& data, ehsid_configuration& c) {
  float* const numbers[] = {&c.command_scale,
                            &c.position_scale,
                            &c.command_offset,
                            &c.position_offset,
                            &c.forgetting.lambda,
                            &c.forgetting.lambda0,
                            &c.forgetting.lambda_initial,
                            &c.forgetting.memory,
                            &c.forgetting.lambda_min,
                            &c.forgetting.noise_variance,
                            &c.forgetting.eta,
                            &c.forgetting.critical_ratio,
                            &c.information_margin,
                            &c.covariance_ceiling,
                            &c.reset_short_window,
                            &c.reset_long_window,
                            &c.reset_trigger_ratio,
                            &c.reset_release_ratio,
                            &c.reset_floor,
                            &c.convergence_tolerance,
                            &c.convergence_magnitude,
                            &c.variance0,
                            &c.input_limit};
  constexpr int kNumbers = sizeof numbers / sizeof numbers[0];
  for (int changes = data.up_to(3); changes > 0; --changes) {
    *numbers[data.up_to(kNumbers - 1)] = data.real();
  }
  switch (data.up_to(7)) {
    case 1:
      c.reset_cool_down = data.next<std::int32_t>();
      break;
    case 2:
      c.convergence_hold = data.next<std::int32_t>();
      break;
    case 3:
      c.na = data.next<std::int32_t>();
      break;
    case 4:
      c.nk = data.next<std::int32_t>();
      break;
    case 5:
      c.kernel = nullptr;
      break;
    case 6:
      c.reset_enabled = data.coin();
      break;
    default:
      break;
  }
}

ehsid_estimate estimate(fuzz::Data& data) {
  ehsid_estimate made{};
  std::fill_n(made.d, EHSID_MAX_PARAMETERS, 1.0F);
  for (int changes = data.up_to(7); changes > 0; --changes) {
    const int i = data.up_to(EHSID_MAX_PARAMETERS - 1);
    made.theta[i] = data.real();
    made.d[i] = data.real();
    made.u[data.up_to(EHSID_MAX_UPPER - 1)] = data.real();
  }
  made.noise_variance = data.coin() ? data.real() : 0.0F;
  return made;
}

void init(fuzz::Data& data, Place& place) {
  const int which = data.up_to(kKernelCount - 1);
  const ehsid_kernel* kernel = kKernels[which];
  const int n = kSizes[which % 4];
  const bool offset = n % 2 == 1;
  const int na = n / 2;
  const int nb = n - na - (offset ? 1 : 0);
  ehsid_configuration configuration;
  fuzz::check(ehsid_default_configuration(&configuration, kernel, na, nb, data.up_to(20), offset) ==
                  EHSID_OK,
              "orders in their ranges are accepted");
  const ehsid_estimate seed = estimate(data);
  if (data.coin()) {
    change_settings(data, configuration);
    configuration.seed = data.coin() ? &seed : nullptr;
  }

  const std::size_t needed = ehsid_storage_bytes(kernel);
  const std::size_t bytes = data.coin() ? needed : std::size_t{data.next<std::uint16_t>()} % 4096;
  const std::size_t misaligned = data.up_to(3) == 0 ? std::size_t(data.up_to(7)) : 0;
  Place made;
  made.bytes = bytes + misaligned;
  made.storage = std::make_unique<std::uint8_t[]>(made.bytes + 1);
  made.plant = place.plant;
  const ehsid_status status =
      ehsid_init(&made.estimator, made.storage.get() + misaligned, bytes, &configuration);
  fuzz::check((status == EHSID_OK) == (made.estimator != nullptr),
              "there is an estimator where the status says so");
  if (status == EHSID_OK) {
    fuzz::check(bytes >= needed && misaligned == 0, "storage is large enough and aligned");
    fuzz::check_c_outputs(made.estimator);
    place = std::move(made);
    return;
  }
  // Over an estimator that is there: a refusal leaves it.
  if (place.estimator != nullptr) {
    const std::vector<std::uint8_t> before = place.copy();
    ehsid_estimator* estimator = place.estimator;
    configuration.kernel = nullptr;
    fuzz::check(ehsid_init(&estimator, place.storage.get(), place.bytes, &configuration) ==
                        EHSID_INVALID_ARGUMENT &&
                    estimator == place.estimator && place.copy() == before,
                "a refused configuration changes nothing");
  }
}

void step(fuzz::Data& data, Place& place) {
  const float command = data.real();
  const float position = data.real();
  if (!ehsid_is_error(ehsid_step(place.estimator, command, position))) {
    fuzz::check_c_outputs(place.estimator);
  }
}

void steps(fuzz::Data& data, Place& place) {
  for (int left = data.up_to(63); left > 0; --left) {
    place.plant.advance();
    if (!ehsid_is_error(ehsid_step(place.estimator, place.plant.command, place.plant.position))) {
      fuzz::check_c_outputs(place.estimator);
    }
  }
}

/// One of the calls that give n numbers, with room for `count` of them.
void numbers(fuzz::Data& data, const Place& place) {
  using Call = ehsid_status (*)(const ehsid_estimator*, float*, std::size_t);
  constexpr Call kCalls[] = {ehsid_theta, ehsid_standard_deviation, ehsid_covariance_diagonal};
  const Call call = kCalls[data.up_to(2)];
  const auto count = static_cast<std::size_t>(data.up_to(20));
  const auto room = std::make_unique<float[]>(count);
  const ehsid_status status =
      call(place.estimator, data.up_to(7) == 0 ? nullptr : room.get(), count);
  fuzz::check(status != EHSID_OK || count >= ehsid_parameters(place.estimator),
              "numbers are given only where there is room");
}

void save(fuzz::Data& data, const Place& place, std::vector<std::uint8_t>& saved) {
  std::vector<std::uint8_t> room(std::size_t{data.next<std::uint16_t>()} % 4096);
  std::size_t written = 0;
  const ehsid_status status =
      ehsid_save(place.estimator, data.up_to(7) == 0 ? nullptr : room.data(), room.size(),
                 data.coin() ? &written : nullptr);
  if (status == EHSID_OK && written > 0) {
    room.resize(written);
    saved = room;
    ehsid_snapshot_fault fault = EHSID_SNAPSHOT_FITS;
    fuzz::check(
        ehsid_check_snapshot(place.estimator, saved.data(), saved.size(), &fault) == EHSID_OK &&
            fault == EHSID_SNAPSHOT_FITS,
        "an estimator takes its own snapshot");
  }
}

void restore(fuzz::Data& data, Place& place, const std::vector<std::uint8_t>& saved) {
  const auto shift = static_cast<std::size_t>(data.up_to(7));  // any alignment
  std::vector<std::uint8_t> bytes(shift + saved.size());
  std::copy(saved.begin(), saved.end(), bytes.begin() + static_cast<std::ptrdiff_t>(shift));
  for (int changes = data.up_to(3); changes > 0 && !saved.empty(); --changes) {
    bytes[shift + data.next<std::uint16_t>() % saved.size()] = data.next<std::uint8_t>();
  }
  const std::size_t count =
      data.up_to(7) == 0 ? data.next<std::uint16_t>() % (saved.size() + 1) : saved.size();
  const std::vector<std::uint8_t> before = place.copy();
  const void* from = data.up_to(7) == 0 ? nullptr : bytes.data() + shift;
  if (ehsid_is_error(ehsid_restore(place.estimator, from, count))) {
    fuzz::check(place.copy() == before, "a refused snapshot changes nothing");
  } else {
    fuzz::check_c_outputs(place.estimator);
  }
}

void seed(fuzz::Data& data, Place& place) {
  const ehsid_estimate given = estimate(data);
  const std::vector<std::uint8_t> before = place.copy();
  if (ehsid_is_error(ehsid_seed(place.estimator, data.up_to(7) == 0 ? nullptr : &given))) {
    fuzz::check(place.copy() == before, "a refused seed changes nothing");
  } else {
    fuzz::check_c_outputs(place.estimator);
  }
}

/// Every call where there is no estimator: NULL, or storage that no ehsid_init() has seen.
void without_estimator(fuzz::Data& data) {
  std::uint64_t empty[EHSID_STORAGE_WORDS(2)] = {};
  ehsid_estimator* none = data.coin() ? reinterpret_cast<ehsid_estimator*>(empty) : nullptr;
  const ehsid_status expected = none == nullptr ? EHSID_INVALID_ARGUMENT : EHSID_NOT_INITIALISED;
  float room[EHSID_MAX_PARAMETERS] = {};
  ehsid_report report = {};
  const ehsid_estimate given{};
  fuzz::check(ehsid_step(none, 0.0F, 0.0F) == expected && ehsid_reset(none) == expected &&
                  ehsid_seed(none, &given) == expected && ehsid_enable(none, true) == expected &&
                  ehsid_theta(none, room, 13) == expected &&
                  ehsid_standard_deviation(none, room, 13) == expected &&
                  ehsid_covariance_diagonal(none, room, 13) == expected &&
                  ehsid_covariance(none, room, 13) == expected &&
                  ehsid_read(none, &report) == expected &&
                  ehsid_save(none, room, sizeof room, nullptr) == expected &&
                  ehsid_restore(none, room, sizeof room) == expected && ehsid_parameters(none) == 0,
              "no call works without an estimator");
}

void without_object(fuzz::Data& data) {
  ehsid_configuration configuration;
  const ehsid_kernel* kernel = data.coin() ? kKernels[data.up_to(kKernelCount - 1)] : nullptr;
  const bool made =
      ehsid_default_configuration(data.up_to(7) == 0 ? nullptr : &configuration, kernel,
                                  data.next<std::int32_t>(), data.next<std::int8_t>(),
                                  data.next<std::int8_t>(), data.coin()) == EHSID_OK;
  fuzz::check(!made || kernel != nullptr, "no configuration without a kernel");
  fuzz::check((ehsid_storage_bytes(kernel) > 0) == (kernel != nullptr) &&
                  (ehsid_snapshot_bytes(kernel) > 0) == (kernel != nullptr),
              "sizes are 0 for NULL only");
  fuzz::check(ehsid_status_name(static_cast<ehsid_status>(data.up_to(15)))[0] != '\0',
              "every status has a name");
}

void call(fuzz::Data& data, Place& place, std::vector<std::uint8_t>& saved) {
  ehsid_report report = {};
  switch (data.up_to(12)) {
    case 0:
    case 1:
      return init(data, place);
    case 2:
      return step(data, place);
    case 3:
    case 4:
      return steps(data, place);
    case 5:
      static_cast<void>(ehsid_reset(place.estimator));
      return;
    case 6:
      return seed(data, place);
    case 7:
      static_cast<void>(ehsid_enable(place.estimator, data.coin()));
      return;
    case 8:
      return numbers(data, place);
    case 9:
      static_cast<void>(ehsid_read(place.estimator, data.coin() ? &report : nullptr));
      return;
    case 10:
      return save(data, place, saved);
    case 11:
      return restore(data, place, saved);
    default:
      return data.coin() ? without_estimator(data) : without_object(data);
  }
}

}  // namespace

int LLVMFuzzerTestOneInput(const std::uint8_t* bytes, std::size_t count) {
  fuzz::Data data(bytes, count);
  Places places;
  std::vector<std::uint8_t> saved;
  for (int calls = 0; calls < kMostCalls && !data.empty(); ++calls) {
    call(data, places[static_cast<std::size_t>(data.up_to(kEstimators - 1))], saved);
  }
  return 0;
}
