// SPDX-License-Identifier: MIT
// The members of plain structs as a sequence of bytes that is the same on every machine: no padding, least significant
// byte first, numbers as their IEEE 754 or two's complement bits.
//
// A struct lists its members once, in the order of the bytes:
//   template <class Visit>
//   EHSID_ALWAYS_INLINE static constexpr void fields(Visit visit) {
//     visit(&State::theta, each_parameter);  // an array of which the first n are in use
//     visit(&State::weight);                 // a number, a whole array, or a struct with fields() of its own, or an array
//   }                                        // of such structs
// A new member is one more line. Where a member is forgotten, the program does not compile.
#pragma once

#include <ehsid/crc32.hpp>
#include <ehsid/parts.hpp>
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
  std::uint16_t offset = 0;  // parameters behind b: 1 with a constant term

  constexpr ModelShape() = default;
  constexpr ModelShape(int na_in, int nb_in, int nk_in, bool offset_in)
      : na(static_cast<std::uint16_t>(na_in)),
        nb(static_cast<std::uint16_t>(nb_in)),
        nk(static_cast<std::uint16_t>(nk_in)),
        offset(offset_in ? 1 : 0) {}

  template <class Visit>
  EHSID_ALWAYS_INLINE static constexpr void fields(Visit visit) {
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

/// Writes numbers and keeps the checksum of what it wrote, or reads them again. One class for both, because then one
/// sequence of calls does both: that halves the code of a saved state.
class ByteStream {
 public:
  /// To `to`, which has room for all of it; nullptr makes the checksum alone.
  static ByteStream writing(std::uint8_t* to) { return ByteStream(to, nullptr); }
  /// From bytes of which there are enough.
  static ByteStream reading(const std::uint8_t* from) { return ByteStream(nullptr, from); }

  /// Writes `count` numbers.
  template <class Number>
  void values(const Number* numbers, int count) {
    write<sizeof(Number)>(numbers, count);
  }
  /// Writes or reads them.
  template <class Number>
  void values(Number* numbers, int count) {
    pass<sizeof(Number)>(numbers, count);
  }

  /// Of all that was written.
  std::uint32_t checksum() const { return crc_.value(); }

 private:
  ByteStream(std::uint8_t* to, const std::uint8_t* from) : to_(to), from_(from) {}

  template <std::size_t kBytes>
  void pass(void* numbers, int count) {
    if (from_ != nullptr) {
      read<kBytes>(numbers, count);
    } else {
      write<kBytes>(numbers, count);
    }
  }

  template <std::size_t kBytes>
  void write(const void* numbers, int count) {
    const auto* at = static_cast<const std::uint8_t*>(numbers);
    for (int i = 0; i < count; ++i, at += kBytes) {
      typename detail::UnsignedOf<kBytes>::Type bits;
      std::memcpy(&bits, at, kBytes);
      for (unsigned k = 0; k < kBytes; ++k) {
        const auto byte = static_cast<std::uint8_t>(bits >> 8U * k);
        crc_.add(byte);
        if (to_ != nullptr) {
          *to_++ = byte;
        }
      }
    }
  }

  template <std::size_t kBytes>
  void read(void* numbers, int count) {
    using Bits = typename detail::UnsignedOf<kBytes>::Type;
    auto* at = static_cast<std::uint8_t*>(numbers);
    for (int i = 0; i < count; ++i, at += kBytes) {
      Bits bits = 0;
      for (unsigned k = 0; k < kBytes; ++k) {
        bits = static_cast<Bits>(bits | static_cast<Bits>(Bits{*from_++} << 8U * k));
      }
      std::memcpy(at, &bits, kBytes);
    }
  }

  std::uint8_t* to_;
  const std::uint8_t* from_;
  Crc32 crc_{};
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
template <class Type>
inline constexpr std::size_t kStructs = 0;
template <class Struct, std::size_t kCount>
inline constexpr std::size_t kStructs<std::array<Struct, kCount>> =
    std::is_arithmetic<Struct>::value ? 0 : kCount;

/// visit(member, number of values in use ...) for each field; for none where a policy has nothing but settings.
template <class Owner, class Visit>
EHSID_ALWAYS_INLINE constexpr void each_field(Visit visit) {
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
  if constexpr (!std::is_standard_layout_v<Owner> || std::is_empty_v<Owner>) {
    return true;
  } else {
    std::size_t listed = 0;
    std::size_t paddings = 1;  // and one behind each part that is left out
    each_field<Owner>([&](auto member, auto... /*in_use*/) {
      using Member = std::remove_reference_t<decltype(std::declval<Owner&>().*member)>;
      listed += sizeof(Member);
      paddings += std::is_same_v<Member, Nothing> ? 1U : 0U;
    });
    if constexpr (kHasSettings<Owner>) {
      Owner::settings([&](const auto& /*setting*/, auto member) {
        listed += sizeof(std::remove_reference_t<decltype(member(std::declval<Owner&>()))>);
      });
    }
    return listed <= sizeof(Owner) && sizeof(Owner) - listed < paddings * alignof(Owner);
  }
}

/// Adds up the bytes of the fields that it is called with.
template <class Owner>
struct CountBytes {
  const ModelShape& of;
  std::size_t& bytes;

  template <class Member, class... InUse>
  EHSID_ALWAYS_INLINE constexpr void operator()(Member Owner::* /*member*/, InUse... in_use) const {
    if constexpr (kStructs<Member> > 0) {
      for (std::size_t i = 0; i < kStructs<Member>; ++i) {
        each_field<typename Member::value_type>(CountBytes<typename Member::value_type>{of, bytes});
      }
    } else if constexpr (std::is_class_v<Member> && !kIsArray<Member>) {
      each_field<Member>(CountBytes<Member>{of, bytes});
    } else if constexpr (sizeof...(InUse) == 0) {
      bytes += sizeof(Member);
    } else {
      bytes += sizeof(typename Member::value_type) * static_cast<std::size_t>((in_use(of), ...));
    }
  }
};

}  // namespace detail

template <class Owner>
void stream_fields(ByteStream& stream, const ModelShape& of, Owner& owner);

namespace detail {

/// Writes or reads the fields of `owner` that it is called with. The calls become one sequence in every estimator:
/// otherwise each would be a function, a kilobyte of them.
template <class Owner>
struct StreamField {
  ByteStream& stream;
  const ModelShape& of;
  Owner& owner;

  template <class Member, class... InUse>
  EHSID_ALWAYS_INLINE void operator()(Member std::remove_const_t<Owner>::* member,
                                      InUse... in_use) const {
    auto& value = owner.*member;
    if constexpr (std::is_same_v<Member, bool> || std::is_enum_v<Member>) {
      auto byte =
          static_cast<std::uint8_t>(value);  // of which a bool has two and an enumeration some
      stream.values(&byte, 1);
      if constexpr (!std::is_const_v<Owner>) {
        value = static_cast<Member>(byte);
      }
    } else if constexpr (std::is_arithmetic_v<Member>) {
      stream.values(&value, 1);
    } else if constexpr (!kIsArray<Member>) {
      stream_fields(stream, of, value);
    } else if constexpr (kStructs<Member> > 0) {
      for (auto& one : value) {
        stream_fields(stream, of, one);
      }
    } else if constexpr (sizeof...(InUse) == 0) {
      stream.values(value.data(), static_cast<int>(value.size()));
    } else {
      stream.values(value.data(), in_use(of)...);
    }
  }
};

}  // namespace detail

/// Bytes that the fields of a struct take.
template <class Owner>
constexpr std::size_t field_bytes(const ModelShape& of) {
  std::size_t bytes = 0;
  detail::each_field<Owner>(detail::CountBytes<Owner>{of, bytes});
  return bytes;
}

/// Writes the fields of `owner`, or reads them where the stream reads and the owner is not const.
template <class Owner>
void stream_fields(ByteStream& stream, const ModelShape& of, Owner& owner) {
  using Plain = std::remove_const_t<Owner>;
  static_assert(detail::lists_every_member<Plain>(), "fields() of this struct leaves out a member");
  detail::each_field<Plain>(detail::StreamField<Owner>{stream, of, owner});
}

/// How many bytes each field has: what tells structs apart that share their type but for a template argument.
template <class Owner>
void write_layout(ByteStream& writer, const ModelShape& of) {
  detail::each_field<Owner>([&](auto member, auto... in_use) {
    std::size_t bytes = 0;
    detail::CountBytes<Owner>{of, bytes}(member, in_use...);
    const auto number = static_cast<std::uint32_t>(bytes);
    writer.values(&number, 1);
  });
}

/// The settings of a forgetting policy.
template <class Policy>
void write_settings(ByteStream& writer, const Policy& policy) {
  Policy::settings(
      [&](const auto& /*setting*/, auto member) { writer.values(&member(policy), 1); });
}

}  // namespace ehsid
