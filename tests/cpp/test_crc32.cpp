// SPDX-License-Identifier: MIT
#include <ehsid/crc32.hpp>

#include <string>

#include <gtest/gtest.h>

namespace {

std::uint32_t crc_of(const std::string& text) {
  ehsid::Crc32 crc;
  for (const char letter : text) {
    crc.add(static_cast<std::uint8_t>(letter));
  }
  return crc.value();
}

/// The definition, bit by bit.
std::uint32_t by_division(const std::string& text) {
  std::uint32_t rest = 0xFFFFFFFFU;
  for (const char letter : text) {
    rest ^= static_cast<std::uint8_t>(letter);
    for (int bit = 0; bit < 8; ++bit) {
      rest = (rest >> 1U) ^ ((rest & 1U) * 0xEDB88320U);
    }
  }
  return ~rest;
}

TEST(Crc32, HasThePublishedCheckValue) {
  EXPECT_EQ(crc_of("123456789"), 0xCBF43926U);
  EXPECT_EQ(crc_of(""), 0U);
}

TEST(Crc32, IsTheRestOfTheDivision) {
  std::string text;
  std::uint32_t random = 1;
  for (int length = 0; length < 300; ++length) {
    ASSERT_EQ(crc_of(text), by_division(text));
    random = random * 1664525U + 1013904223U;  // Numerical Recipes' generator
    text.push_back(static_cast<char>(random >> 24U));
  }
}

}  // namespace
