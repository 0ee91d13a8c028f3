// SPDX-License-Identifier: MIT
// Little-endian numbers in and out of bytes, whatever the byte order and alignment of the processor.
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstring>

namespace servo {

static_assert(sizeof(float) == 4, "f32 of the protocol is float");

/// Bytes that belong to somebody else.
struct Bytes {
  const std::uint8_t* data = nullptr;
  std::size_t count = 0;
};

/// Numbers one behind the other. What lies beyond the end reads as 0, and good() is false from then on.
class Reader {
 public:
  explicit Reader(Bytes bytes) : bytes_(bytes) {}

  std::uint8_t u8() { return static_cast<std::uint8_t>(number(1)); }
  std::uint16_t u16() { return static_cast<std::uint16_t>(number(2)); }
  std::uint32_t u32() { return number(4); }
  std::int32_t i32() { return copied<std::int32_t>(number(4)); }
  float f32() { return copied<float>(number(4)); }

  bool good() const { return good_; }
  /// What has not been read yet.
  Bytes rest() const { return {bytes_.data + at_, bytes_.count - at_}; }

 private:
  std::uint32_t number(std::size_t count) {
    good_ = good_ && bytes_.count - at_ >= count;
    if (!good_) {
      return 0;
    }
    std::uint32_t value = 0;
    for (std::size_t i = count; i > 0; --i) {
      value = value << 8U | bytes_.data[at_ + i - 1];
    }
    at_ += count;
    return value;
  }

  template <class To>
  static To copied(std::uint32_t word) {
    static_assert(sizeof(To) == sizeof word, "the bits are kept");
    To value;
    std::memcpy(&value, &word, sizeof value);
    return value;
  }

  Bytes bytes_;
  std::size_t at_ = 0;
  bool good_ = true;
};

/// Numbers one behind the other into `room` bytes. What finds no room is left out, and good() is false.
class Writer {
 public:
  constexpr Writer(std::uint8_t* to, std::size_t room) : to_(to), room_(room) {}

  void u8(std::uint8_t value) { number(value, 1); }
  void u16(std::uint16_t value) { number(value, 2); }
  void u32(std::uint32_t value) { number(value, 4); }
  void f32(float value) {
    std::uint32_t word = 0;
    std::memcpy(&word, &value, sizeof word);
    number(word, 4);
  }

  bool good() const { return good_; }
  std::size_t count() const { return count_; }

 private:
  void number(std::uint32_t value, std::size_t bytes) {
    good_ = good_ && room_ - count_ >= bytes;
    for (std::size_t i = 0; good_ && i < bytes; ++i) {
      to_[count_++] = static_cast<std::uint8_t>(value >> (8U * i));
    }
  }

  std::uint8_t* to_;
  std::size_t room_;
  std::size_t count_ = 0;
  bool good_ = true;
};

}  // namespace servo
