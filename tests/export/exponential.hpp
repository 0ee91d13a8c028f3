// Written by `ehsid export`, ehsid 0.2.0; do not edit, export again.
// Settings and start of the online estimator, and a self-test for the target. Numbers are float32 in
// hexadecimal, exact to the bit; decimals are for people.
//
// Record hydraulic_crane.csv, sha256
// 3fd24a1fe2d09e4635d068aea802cae4bebe600b7691387647fca79c80c9b4ba
// Made by tests/export/make_headers.py
//
// Results are bit for bit those of Python where the compiler does not fuse multiplications and additions
// (-ffp-contract=off, as the CMake target ehsid::reproducible sets it), nor uses -ffast-math.
// clang-format off
#pragma once

#include <cstdint>
#include <cstring>
#include <ehsid/ehsid.hpp>

namespace exponential {

/// na = 3, nb = 3, nk = 1.
using Estimator =
    ehsid::ArxEstimator<float, 3, 3, 1, ehsid::Exponential<float>>;

/// Sampling time of the record, s; the parameters hold for no other.
inline constexpr float kDtS = 0x1.99999ap-5F;  // 0.05

/// theta_0, in the units of the signals about the offsets of the scaling.
inline constexpr ehsid::Array<float, Estimator::kN> kTheta0 = {{
    -0x1.978d5p+0F,  // a1 = -1.592
    0x1.b34d6ap-2F,  // a2 = 0.4251
    0x1.d013aap-3F,  // a3 = 0.2266
    0x1.b2fec6p-1F,  // b1 = 0.8496
    -0x1.3c28f6p+1F,  // b2 = -2.47
    0x1.8624dep+0F,  // b3 = 1.524
}};

/// P_0 = U D U' of the scaled parameters in units of sigma^2: D, then the columns of U above its diagonal.
inline constexpr ehsid::UdFactors<float, Estimator::kN> kFactors0 = {
    {{
        0x1.4801f8p-7F,  // 0.01001
        0x1.fd70a4p-2F,  // 0.4975
        0x1.d91688p+0F,  // 1.848
        0x1.f5ad96p-6F,  // 0.03062
        0x1.3b74bcp+2F,  // 4.929
        0x1.400a3ep+6F,  // 80.01
    }},
    {{
        -0x1.f9e83ep-1F,  // -0.9881
        0x1.b4e3bcp-1F,  // 0.8533
        -0x1.d58106p+0F,  // -1.834
        -0x1.4b22dp+1F,  // -2.587
        0x1.0d4fep+2F,  // 4.208
        -0x1.3c6a7ep+1F,  // -2.472
        0x1.2b55fp-4F,  // 0.07308
        -0x1.1719f8p-4F,  // -0.06814
        -0x1.0d5a5cp-7F,  // -0.00822
        -0x1.fdb22ep-1F,  // -0.9955
        0x1.835158p-7F,  // 0.01182
        -0x1.8ff75ap-8F,  // -0.006103
        -0x1.7add16p-8F,  // -0.005781
        0x1.e95182p-1F,  // 0.9557
        -0x1.f3f7cep+0F,  // -1.953
    }},
};

/// sigma^2 of the offline model, squared units of the position.
inline constexpr float kNoiseVariance = 0x1.5475a4p-7F;  // 0.01039

/// Sets the estimator up and starts it from the offline model; ok, unless this file was changed.
inline ehsid::Status configure(Estimator& estimator) {
  Estimator::Options options;
  options.scaling.command_scale = 0x1.60d1b8p-1F;  // 0.6891
  options.scaling.position_scale = 0x1.845a1cp+0F;  // 1.517
  options.scaling.command_offset = -0x1.875f7p-3F;  // -0.1911
  options.scaling.position_offset = 0x1.7b634ep-8F;  // 0.005789
  options.forgetting.lambda0 = 0x1.fd70a4p-1F;  // 0.995
  options.forgetting.lambda_initial = 0x1.f0a3d8p-1F;  // 0.97
  options.rls.information_margin = 0x1.8p+0F;  // 1.5
  options.rls.covariance_ceiling = 0x1p+1F;  // 2
  options.reset.short_window = 0x1.4p+2F;  // 5
  options.reset.long_window = 0x1.ep+5F;  // 60
  options.reset.trigger_ratio = 0x1p+1F;  // 2
  options.reset.release_ratio = 0x1.8p+0F;  // 1.5
  options.reset.cool_down = 50;
  options.reset.floor = 0x1.4f8b58p-17F;  // 1e-05
  options.convergence.tolerance = 0x1.99999ap-4F;  // 0.1
  options.convergence.magnitude = 0x1.99999ap-4F;  // 0.1
  options.convergence.hold = 10;
  options.variance0 = Estimator::Parameters::Constant(Estimator::kN, 0x1.e848p+19F);  // 1e+06
  options.input_limit = 0x1.f4p+9F;  // 1000
  const ehsid::Status status = estimator.configure(options);
  if (status != ehsid::Status::ok) {
    return status;
  }
  return estimator.seed(ehsid::to_vector<Estimator::kN>(Estimator::kN, kTheta0), kFactors0, kNoiseVariance);
}

/// A sample of the golden trace: command and position in their units, and the innovation after it.
struct TraceSample {
  float command;
  float position;
  float innovation;
};

inline constexpr ehsid::Array<TraceSample, 16> kTrace = {{
    {0x1.ae429ep-1F, -0x1.8e9332p+1F, 0x0p+0F},
    {0x1.77429ap-1F, -0x1.8f540ap+1F, 0x0p+0F},
    {0x1.37829p-1F, -0x1.926558p+1F, 0x0p+0F},
    {0x1.f20536p-2F, -0x1.9500a6p+1F, -0x1.48447cp-3F},
    {0x1.7c853cp-2F, -0x1.971f36p+1F, -0x1.5a4c58p-3F},
    {0x1.13854p-2F, -0x1.8dd0bap+1F, -0x1.1e4efep-4F},
    {0x1.5f0a1cp-3F, -0x1.0d773cp+1F, 0x1.99b1c6p-1F},
    {0x1.921484p-4F, -0x1.98ed52p-1F, 0x1.b2137ep-2F},
    {0x1.9428e2p-5F, 0x1.7cd926p-3F, 0x0p+0F},
    {0x1.a0a37ap-7F, 0x1.52d2bcp+0F, 0x1.f4c22ep-3F},
    {-0x1.cf5bf4p-7F, 0x1.13b7f6p+1F, -0x1.80a1ap-3F},
    {-0x1.b3d6fcp-5F, 0x1.6231dp+1F, 0x1.7b1b66p-2F},
    {-0x1.51eb86p-4F, 0x1.b5eacap+1F, 0x1.aa714ap-2F},
    {-0x1.79eb7ep-4F, 0x1.c239cp+1F, -0x1.093edcp-1F},
    {-0x1.79eb7ep-4F, 0x1.bc0ddap+1F, -0x1.16adc2p-1F},
    {-0x1.79eb7ep-4F, 0x1.b30f34p+1F, -0x1.1c9956p-3F},
}};

/// theta_hat after the trace.
inline constexpr ehsid::Array<float, Estimator::kN> kTraceTheta = {{
    -0x1.6a2ca4p-1F,  // -0.707372
    -0x1.41065cp-2F,  // -0.313501
    0x1.33e09p-3F,  // 0.150331
    -0x1.61fbacp+3F,  // -11.062
    0x1.a2cb28p+4F,  // 26.1746
    -0x1.4dbb0ap+3F,  // -10.4291
}};

inline bool same_bits(float left, float right) {
  std::uint32_t left_bits = 0;
  std::uint32_t right_bits = 0;
  std::memcpy(&left_bits, &left, sizeof left);
  std::memcpy(&right_bits, &right, sizeof right);
  return left_bits == right_bits;
}

/// Runs the trace through an estimator of its own, sizeof(Estimator) bytes on the stack. True where every
/// innovation and the last theta_hat are, bit for bit, those that Python computed.
inline bool self_test() {
  Estimator estimator;
  bool same = configure(estimator) == ehsid::Status::ok;
  for (const TraceSample& sample : kTrace) {
    same = !ehsid::is_error(estimator.step(sample.command, sample.position)) &&
           same_bits(estimator.innovation(), sample.innovation) && same;
  }
  const Estimator::Parameters theta = estimator.theta_hat();
  for (int i = 0; i < Estimator::kN; ++i) {
    same = same_bits(theta[i], ehsid::entry(kTraceTheta, i)) && same;
  }
  return same;
}

}  // namespace exponential
