// SPDX-License-Identifier: MIT
// The members of plain structs as a sequence of bytes that is the same on every machine: no padding, least significant
// byte first, numbers as their IEEE 754 or two's complement bits.
//
// A struct lists its members once, in the order of the bytes:
//   template <class Visit>
//   static constexpr void fields(Visit visit) {
//     visit(&State::theta, each_parameter);  // an array of which the first n are in use
//     visit(&State::weight);                 // a number, a whole array, or a struct with fields() of its own
//   }
// A new member is one more line. Where a member is forgotten, the program does not compile.
#pragma once

#include <ehsid/crc32.hpp>
#include <ehsid/types.hpp>

#include <array>
#include <type_traits>
#include <utility>

namespace ehsid {

/// Orders of a model. What the number of values in use depends on where a size is chosen at run time.
struct ModelShape {
  std::uint16_t na = 0;
  std::uint16_t nb = 0;
  std::uint16_t nk = 0;
  std::uint16_t offset = 0;  // 1 with a constant term

  constexpr ModelShape() = default;
  constexpr ModelShape(int na_in, int nb_in, int nk_in, bool offset_in)
      : na(static_cast<std::uint16_t>(na_in)),
        nb(static_cast<std::uint16_t>(nb_in)),
        nk(static_cast<std::uint16_t>(nk_in)),
        offset(offset_in ? 1 : 0) {}

  template <class Visit>
  static constexpr void fields(Visit visit) {
    visit(&ModelShape::na);
    visit(&ModelShape::nb);
    visit(&ModelShape::nk);
    visit(&ModelShape::offset);
  }

  constexpr int size() const { return na + nb + offset; }

  friend constexpr bool operator==(const ModelShape& a, const ModelShape& b) {
    return a.na == b.na && a.nb == b.nb && a.nk == b.nk && a.offset == b.offset;
  }
};

// How many numbers of an array are in use.
constexpr int each_parameter(const ModelShape& of) { return of.size(); }
constexpr int each_pair(const ModelShape& of) { return of.size() * (of.size() - 1) / 2; }
constexpr int each_output(const ModelShape& of) { return of.na; }
constexpr int each_command(const ModelShape& of) { return of.nk + of.nb; }

namespace detail {

template <std::size_t kBytes>
struct UnsignedOf;
template <>
struct UnsignedOf<1> {
  using Type = std::uint8_t;
};
template <>
struct UnsignedOf<2> {
  using Type = std::uint16_t;
};
template <>
struct UnsignedOf<4> {
  using Type = std::uint32_t;
};
template <>
struct UnsignedOf<8> {
  using Type = std::uint64_t;
};

}  // namespace detail

/// Writes numbers and keeps the checksum of what it wrote. Without a destination it makes the checksum alone.
class ByteWriter {
 public:
  explicit ByteWriter(std::uint8_t* to) : to_(to) {}

  template <class Number>
  void value(Number number) {
    typename detail::UnsignedOf<sizeof(Number)>::Type bits;
    std::memcpy(&bits, &number, sizeof bits);
    for (unsigned i = 0; i < sizeof bits; ++i) {
      byte(static_cast<std::uint8_t>(bits >> 8U * i));
    }
  }

  template <class Number>
  void values(const Number* from, int count) {
    for (int i = 0; i < count; ++i) {
      value(from[i]);
    }
  }

  std::uint32_t checksum() const { return crc_.value(); }

 private:
  void byte(std::uint8_t byte) {
    crc_.add(byte);
    if (to_ != nullptr) {
      *to_++ = byte;
    }
  }

  std::uint8_t* to_;
  Crc32 crc_{};
};

/// Reads what a ByteWriter wrote. The caller knows that there are enough bytes.
class ByteReader {
 public:
  explicit ByteReader(const std::uint8_t* from) : from_(from) {}

  template <class Number>
  void value(Number& number) {
    using Bits = typename detail::UnsignedOf<sizeof(Number)>::Type;
    Bits bits = 0;
    for (unsigned i = 0; i < sizeof bits; ++i) {
      bits = static_cast<Bits>(bits | static_cast<Bits>(Bits{*from_++} << 8U * i));
    }
    std::memcpy(&number, &bits, sizeof bits);
  }

  template <class Number>
  void values(Number* to, int count) {
    for (int i = 0; i < count; ++i) {
      value(to[i]);
    }
  }

 private:
  const std::uint8_t* from_;
};

namespace detail {

struct Anything {
  template <class... Arguments>
  constexpr void operator()(const Arguments&... /*arguments*/) const {}
};

template <class Owner, class = void>
inline constexpr bool kHasFields = false;
template <class Owner>
inline constexpr bool kHasFields<Owner, std::void_t<decltype(Owner::fields(Anything{}))>> = true;

template <class Owner, class = void>
inline constexpr bool kHasSettings = false;
template <class Owner>
inline constexpr bool kHasSettings<Owner, std::void_t<decltype(Owner::settings(Anything{}))>> =
    true;

template <class Type>
inline constexpr bool kIsArray = false;
template <class Number, std::size_t kCount>
inline constexpr bool kIsArray<std::array<Number, kCount>> = true;

/// visit(member, number of values in use ...) for each field; for none where a policy has nothing but settings.
template <class Owner, class Visit>
constexpr void each_field(Visit visit) {
  if constexpr (kHasFields<Owner>) {
    Owner::fields(visit);
  } else {
    static_assert(kHasSettings<Owner>, "a struct whose members are saved needs fields()");
  }
}

/// Are all members of the struct among its fields and settings? What is left over can only be padding. A size chosen at
/// run time is a member of a base, which makes the layout other than standard: there the same struct of static size is
/// the one that is checked.
template <class Owner>
constexpr bool lists_every_member() {
  if constexpr (!std::is_standard_layout_v<Owner>) {
    return true;
  } else {
    std::size_t listed = 0;
    const auto count = [&listed](const auto& member) {
      listed += sizeof(std::declval<Owner&>().*member);
    };
    each_field<Owner>([&](auto member, auto... /*in_use*/) { count(member); });
    if constexpr (kHasSettings<Owner>) {
      Owner::settings([&](const auto& /*setting*/, auto member) {
        listed += sizeof(std::remove_reference_t<decltype(member(std::declval<Owner&>()))>);
      });
    }
    return std::is_empty_v<Owner> ||
           (listed <= sizeof(Owner) && sizeof(Owner) - listed < alignof(Owner));
  }
}

template <class Stream, class Value, class... InUse>
void stream_value(Stream& stream, const ModelShape& of, Value& value, InUse... in_use);

template <class Value, class... InUse>
constexpr std::size_t value_bytes(const ModelShape& of, InUse... in_use) {
  if constexpr (std::is_arithmetic_v<Value>) {
    return sizeof(Value);
  } else if constexpr (!kIsArray<Value>) {
    std::size_t bytes = 0;
    each_field<Value>([&](auto member, auto... inner) {
      bytes += value_bytes<std::decay_t<decltype(std::declval<Value&>().*member)>>(of, inner...);
    });
    return bytes;
  } else if constexpr (sizeof...(InUse) == 0) {
    return sizeof(Value);
  } else {
    return sizeof(typename Value::value_type) * static_cast<std::size_t>((in_use(of), ...));
  }
}

}  // namespace detail

/// Writes the fields of `owner` (Stream: ByteWriter) or reads them (ByteReader).
template <class Stream, class Owner>
void stream_fields(Stream& stream, const ModelShape& of, Owner& owner) {
  static_assert(detail::lists_every_member<std::remove_const_t<Owner>>(),
                "fields() of this struct leaves out a member");
  detail::each_field<std::remove_const_t<Owner>>([&](auto member, auto... in_use) {
    detail::stream_value(stream, of, owner.*member, in_use...);
  });
}

/// How many bytes each field has: what tells structs apart that share their type but for a template argument.
template <class Owner>
void write_layout(ByteWriter& writer, const ModelShape& of) {
  detail::each_field<Owner>([&](auto member, auto... in_use) {
    using Value = std::decay_t<decltype(std::declval<Owner&>().*member)>;
    writer.value(static_cast<std::uint32_t>(detail::value_bytes<Value>(of, in_use...)));
  });
}

/// The settings of a forgetting policy, those that have one for each parameter n times.
template <class Policy>
void write_settings(ByteWriter& writer, const ModelShape& of, const Policy& policy) {
  Policy::settings([&](const auto& /*setting*/, auto member) {
    const auto& setting = member(policy);
    if constexpr (std::is_arithmetic_v<std::remove_reference_t<decltype(setting)>>) {
      writer.value(setting);
    } else {
      writer.values(setting.data(), of.size());
    }
  });
}

namespace detail {

template <class Stream, class Value, class... InUse>
void stream_value(Stream& stream, const ModelShape& of, Value& value, InUse... in_use) {
  using Plain = std::remove_const_t<Value>;
  if constexpr (std::is_arithmetic_v<Plain>) {
    stream.value(value);
  } else if constexpr (!kIsArray<Plain>) {
    stream_fields(stream, of, value);
  } else if constexpr (sizeof...(InUse) == 0) {
    stream.values(value.data(), static_cast<int>(value.size()));
  } else {
    stream.values(value.data(), in_use(of)...);
  }
}

}  // namespace detail

/// Bytes that the fields of a struct take.
template <class Owner>
constexpr std::size_t field_bytes(const ModelShape& of) {
  return detail::value_bytes<Owner>(of);
}

}  // namespace ehsid
