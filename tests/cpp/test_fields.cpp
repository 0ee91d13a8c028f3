// SPDX-License-Identifier: MIT
#include <ehsid/fields.hpp>

#include <array>

#include <gtest/gtest.h>

namespace {

using ehsid::ByteStream;
using ehsid::ModelShape;

struct Inner {
  std::uint8_t small;
  double wide;  // seven bytes of padding before it

  template <class Visit>
  static constexpr void fields(Visit visit) {
    visit(&Inner::small);
    visit(&Inner::wide);
  }
};

struct Outer {
  std::uint16_t first;
  Inner inner;
  std::array<float, 4> used;  // as many as there are outputs
  std::array<std::int32_t, 2> whole;

  template <class Visit>
  static constexpr void fields(Visit visit) {
    visit(&Outer::first);
    visit(&Outer::inner);
    visit(&Outer::used, ehsid::each_output);
    visit(&Outer::whole);
  }
};

struct Forgetful {
  float named;
  float forgotten;

  template <class Visit>
  static constexpr void fields(Visit visit) {
    visit(&Forgetful::named);
  }
};

constexpr ModelShape kShape(2, 1, 1, false);
static_assert(ehsid::field_bytes<Outer>(kShape) == 2 + 1 + 8 + 2 * 4 + 2 * 4, "known beforehand");
static_assert(ehsid::detail::lists_every_member<Outer>(), "all of them, with padding in between");
static_assert(!ehsid::detail::lists_every_member<Forgetful>(), "one is missing");

constexpr std::array<std::uint8_t, 27> kBytes{
    0x34, 0x12,                                      // 0x1234
    0x07,                                            // 7
    0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0xF8, 0xBF,  // -1.5
    0x00, 0x00, 0x80, 0x3F, 0x00, 0x00, 0x00, 0x40,  // 1, 2
    0xFE, 0xFF, 0xFF, 0xFF, 0x00, 0x01, 0x00, 0x00,  // -2, 256
};

Outer example(int memory) {
  Outer made;
  std::memset(&made, memory, sizeof made);  // so that padding is seen, if it is written
  made.first = 0x1234;
  made.inner.small = 7;
  made.inner.wide = -1.5;
  made.used[0] = 1.0F;
  made.used[1] = 2.0F;
  made.whole = {-2, 256};
  return made;
}

TEST(Fields, AreTheNumbersAloneLeastSignificantByteFirst) {
  for (const int memory : {0x00, 0xFF}) {
    const Outer made = example(memory);
    std::array<std::uint8_t, kBytes.size()> bytes{};
    ByteStream writer = ByteStream::writing(bytes.data());
    ehsid::stream_fields(writer, kShape, made);
    EXPECT_EQ(bytes, kBytes);
    ByteStream alone = ByteStream::writing(nullptr);
    ehsid::stream_fields(alone, kShape, made);
    EXPECT_EQ(alone.checksum(), writer.checksum());
  }
}

TEST(Fields, AreReadBackAndNothingElseIsTouched) {
  Outer made = example(0xFF);
  made.used[2] = 33.0F;
  made.used[0] = 0.0F;
  made.inner.wide = 0.0;
  ByteStream reader = ByteStream::reading(kBytes.data());
  ehsid::stream_fields(reader, kShape, made);
  EXPECT_EQ(made.first, 0x1234);
  EXPECT_EQ(made.inner.small, 7);
  EXPECT_EQ(made.inner.wide, -1.5);
  EXPECT_EQ(made.used[0], 1.0F);
  EXPECT_EQ(made.used[1], 2.0F);
  EXPECT_EQ(made.used[2], 33.0F);
  EXPECT_EQ(made.whole[0], -2);
  EXPECT_EQ(made.whole[1], 256);
}

}  // namespace
