// SPDX-License-Identifier: MIT
// A third of the golden trace, from states that the line before it on the serial line brought, and the states
// after it in the same form. So one program, run on the host, on the target and on the host again, each reading
// what the one before wrote, goes through the whole trace:
//
//   row <first row>
//   <state as hexadecimal bytes>        for each policy, unless the first row is 0
//
// Every row must be that of the trace to the last bit.
#include "golden_trace.hpp"

namespace {

using firmware::Report;

constexpr std::uint32_t kThird = 220;
constexpr std::uint32_t kUnreadable = 0xFFFFFFFFU;

char receive() {
  std::uint8_t byte = 0;
  while (!port::read(byte)) {
  }
  return static_cast<char>(byte);
}

std::uint32_t receive_row() {
  for (const char wanted : {'r', 'o', 'w', ' '}) {
    if (receive() != wanted) {
      return kUnreadable;
    }
  }
  std::uint32_t row = 0;
  for (char digit = receive(); digit != '\n'; digit = receive()) {
    if (digit < '0' || digit > '9' || row > firmware::kSamples) {
      return kUnreadable;
    }
    row = row * 10 + static_cast<std::uint32_t>(digit - '0');
  }
  return row;
}

int nibble(char digit) {
  const bool letter = digit >= 'a' && digit <= 'f';
  return digit >= '0' && digit <= '9' ? digit - '0' : letter ? digit - 'a' + 10 : -1;
}

/// False unless exactly `count` bytes and the end of the line come.
bool receive_bytes(std::uint8_t* bytes, std::size_t count) {
  for (std::size_t i = 0; i < count; ++i) {
    const int high = nibble(receive());
    const int low = high < 0 ? -1 : nibble(receive());
    if (low < 0) {
      return false;
    }
    bytes[i] = static_cast<std::uint8_t>(high * 16 + low);
  }
  return receive() == '\n';
}

void send_bytes(const std::uint8_t* bytes, std::size_t count) {
  for (std::size_t i = 0; i < count; ++i) {
    port::write(&"0123456789abcdef"[bytes[i] >> 4U], 1);
    port::write(&"0123456789abcdef"[bytes[i] & 0xFU], 1);
  }
  firmware::put("\n");
}

/// Reads the state of the policy, goes on from it, and leaves the state behind in `saved`.
template <class Forgetting>
[[gnu::noinline]] void third(std::uint32_t first, const char* policy, std::uint8_t* saved,
                             Report& report) {
  using Estimator = firmware::Estimator<Forgetting>;
  Estimator estimator;
  report.check(firmware::configure_golden(estimator) == ehsid::Status::ok, policy, "configuration",
               first);
  if (first > 0) {
    typename Estimator::Snapshot snapshot{};
    if (!report.check(receive_bytes(snapshot.data(), snapshot.size()), policy,
                      "no state of this size", first)) {
      return;
    }
    if (!report.check(estimator.restore(snapshot) == ehsid::Status::ok, policy, "state refused",
                      first)) {
      return;
    }
  }
  firmware::Trace trace;
  firmware::Row row{};
  std::uint32_t sample = 0;
  while (trace.next(row)) {
    if (!row.is_of(policy)) {
      continue;
    }
    if (sample >= first && sample < first + kThird &&
        !firmware::step_as_traced(estimator, row, policy, sample, report)) {
      return;
    }
    ++sample;
  }
  report.check(sample == firmware::kSamples, policy, "rows are missing", sample);
  estimator.save(saved);
}

}  // namespace

int main() {
  port::start();
  Report report;
  const std::uint32_t first = receive_row();
  if (!report.check(first < firmware::kSamples, "input", "no row to begin with", 0)) {
    return report.finish();
  }
  // States go out behind the last check: what comes out of a failure is not taken for states.
  static std::uint8_t saved[6][1024];
  static std::size_t sizes[6];
  int policies = 0;
  firmware::every_policy([&](auto policy, const char* name) {
    using Snapshot = typename firmware::Estimator<decltype(policy)>::Snapshot;
    static_assert(sizeof(Snapshot) <= sizeof saved[0], "room for every state");
    sizes[policies] = sizeof(Snapshot);
    third<decltype(policy)>(first, name, saved[policies], report);
    ++policies;
  });
  if (report.failed()) {
    return report.finish();
  }
  const std::uint32_t next = first + kThird;
  firmware::put("row ");
  firmware::put_number(next < firmware::kSamples ? next : firmware::kSamples);
  firmware::put("\n");
  for (int i = 0; i < policies; ++i) {
    send_bytes(saved[i], sizes[i]);
  }
  return 0;
}
