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

namespace constant {

/// na = 3, nb = 3, nk = 1.
using Estimator =
    ehsid::ArxEstimator<float, 3, 3, 1, ehsid::Constant<float>>;

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
  options.forgetting.lambda = 0x1.f5c29p-1F;  // 0.98
  options.rls.information_margin = 0x1.8p+0F;  // 1.5
  options.rls.covariance_ceiling = 0x1p+1F;  // 2
  options.reset_enabled = false;
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

inline constexpr ehsid::Array<TraceSample, 64> kTrace = {{
    {-0x1.a27d68p-1F, 0x1.cc72c4p+0F, 0x0p+0F},
    {-0x1.e0fd7ep-1F, 0x1.1a8cf2p+1F, 0x0p+0F},
    {-0x1.0c9eecp+0F, 0x1.2d7688p+1F, 0x0p+0F},
    {-0x1.245eb4p+0F, 0x1.372c68p+1F, -0x1.19e19ap-3F},
    {-0x1.321ea4p+0F, 0x1.3932aep+1F, -0x1.2f3548p-4F},
    {-0x1.3c1e7ap+0F, 0x1.2cd974p+1F, -0x1.1398bap-3F},
    {-0x1.411e64p+0F, 0x1.147c46p+1F, -0x1.ae36c4p-4F},
    {-0x1.475ec8p+0F, 0x1.ed5158p+0F, -0x1.0429fcp-4F},
    {-0x1.4a7efap+0F, 0x1.aac9d6p+0F, -0x1.a7cf76p-5F},
    {-0x1.4b1ee2p+0F, 0x1.5e4276p+0F, -0x1.403b58p-4F},
    {-0x1.4b1ee2p+0F, 0x1.3ebb08p+0F, 0x1.e6d33cp-4F},
    {-0x1.4b1ee2p+0F, 0x1.01d402p+0F, -0x1.f16f3cp-4F},
    {-0x1.4a7efap+0F, 0x1.844a8p-1F, -0x1.9c2e4p-4F},
    {-0x1.4a7efap+0F, 0x1.1015eep-1F, -0x1.c9168cp-5F},
    {-0x1.439eaep+0F, 0x1.7893b2p-2F, -0x1.f54f8ap-7F},
    {-0x1.38fefp+0F, 0x1.06c95ap-2F, -0x1.3f0fa4p-6F},
    {-0x1.2efe72p+0F, 0x1.a9646ep-3F, -0x1.e6696cp-11F},
    {-0x1.1f5ec8p+0F, 0x1.8dcc78p-3F, -0x1.0987d2p-6F},
    {-0x1.05beap+0F, 0x1.e29d2p-3F, 0x1.a1803cp-8F},
    {-0x1.c7fd6p-1F, 0x1.4c6c2ep-2F, 0x1.91afd6p-6F},
    {-0x1.7bbd7cp-1F, 0x1.d0d458p-2F, 0x1.52ba78p-5F},
    {-0x1.2f7d74p-1F, 0x1.2d1f32p-1F, 0x1.e92ad4p-6F},
    {-0x1.c3faf4p-2F, 0x1.80390ap-1F, 0x1.194e06p-4F},
    {-0x1.32fad6p-2F, 0x1.dd5418p-1F, 0x1.3d094cp-4F},
    {-0x1.52f5dcp-3F, 0x1.291172p+0F, 0x1.dfdf3ap-4F},
    {-0x1.63d70ap-5F, 0x1.0c9e34p+0F, -0x1.0373p-2F},
    {0x1.4c1476p-4F, 0x1.c9f9f6p-1F, -0x1.1d2b28p-5F},
    {0x1.910a14p-3F, 0x1.f1c8c8p-2F, -0x1.71b6e2p-3F},
    {0x1.39053ap-2F, -0x1.6a0228p-7F, -0x1.37a6a2p-4F},
    {0x1.9d052ap-2F, -0x1.37840cp-3F, 0x1.8a83b8p-2F},
    {0x1.f98528p-2F, -0x1.b9baf2p-2F, -0x1.ac10aap-6F},
    {0x1.24c294p-1F, -0x1.ae1ab8p-1F, -0x1.23ffa4p-3F},
    {0x1.468294p-1F, -0x1.357d72p+0F, 0x1.7b39eep-8F},
    {0x1.65c29p-1F, -0x1.bf34bap+0F, -0x1.7a7becp-3F},
    {0x1.7b0292p-1F, -0x1.2180ep+1F, -0x1.2b555cp-4F},
    {0x1.8c829cp-1F, -0x1.451c16p+1F, 0x1.5358fep-3F},
    {0x1.9a428ep-1F, -0x1.95a2e2p+1F, -0x1.92747ap-2F},
    {0x1.a30292p-1F, -0x1.b2618cp+1F, 0x1.5fa4dep-3F},
    {0x1.abc298p-1F, -0x1.ca4b4ep+1F, 0x1.44effp-5F},
    {0x1.b5c29p-1F, -0x1.e74358p+1F, -0x1.671caap-3F},
    {0x1.c3828p-1F, -0x1.f41346p+1F, -0x1.1d872p-5F},
    {0x1.d14292p-1F, -0x1.fb700ap+1F, -0x1.bf67c6p-5F},
    {0x1.e04296p-1F, -0x1.f978f4p+1F, -0x1.628a1cp-5F},
    {0x1.ef429ap-1F, -0x1.e7ff6cp+1F, 0x1.d8797p-6F},
    {0x1.ff829p-1F, -0x1.e0af2ep+1F, -0x1.1b409ap-3F},
    {0x1.08811cp+0F, -0x1.cc0acp+1F, -0x1.86d74p-8F},
    {0x1.11e108p+0F, -0x1.b38b4cp+1F, 0x1.f7d568p-11F},
    {0x1.1dc14p+0F, -0x1.8fb27ap+1F, 0x1.bbe2acp-5F},
    {0x1.27212ep+0F, -0x1.7e266p+1F, -0x1.0e01d2p-3F},
    {0x1.312104p+0F, -0x1.627f62p+1F, 0x1.446bf4p-6F},
    {0x1.3c6152p+0F, -0x1.53312p+1F, -0x1.da0684p-5F},
    {0x1.42a10ep+0F, -0x1.425202p+1F, 0x1.50fccp-9F},
    {0x1.47a0fap+0F, -0x1.37f9c6p+1F, -0x1.c71814p-6F},
    {0x1.48e172p+0F, -0x1.2713a2p+1F, 0x1.f2e7a4p-5F},
    {0x1.48e172p+0F, -0x1.216002p+1F, -0x1.4f9aeap-5F},
    {0x1.48e172p+0F, -0x1.22fa5cp+1F, -0x1.e0c358p-5F},
    {0x1.48418ap+0F, -0x1.29252cp+1F, -0x1.de3fc2p-6F},
    {0x1.466128p+0F, -0x1.32c0e4p+1F, -0x1.40460ep-6F},
    {0x1.44817p+0F, -0x1.3de15ap+1F, -0x1.57a8e6p-7F},
    {0x1.4340f6p+0F, -0x1.4876d6p+1F, 0x1.6157acp-8F},
    {0x1.40c154p+0F, -0x1.56628ep+1F, -0x1.8514b4p-6F},
    {0x1.3e410cp+0F, -0x1.6381f6p+1F, -0x1.bf9c1cp-7F},
    {0x1.3bc16ap+0F, -0x1.7293b4p+1F, -0x1.da9a0cp-6F},
    {0x1.3a8198p+0F, -0x1.7fc576p+1F, -0x1.d18908p-7F},
}};

/// theta_hat after the trace.
inline constexpr ehsid::Array<float, Estimator::kN> kTraceTheta = {{
    -0x1.85f616p+0F,  // -1.52329
    0x1.07c52p-2F,  // 0.257588
    0x1.4dad5cp-2F,  // 0.325857
    -0x1.89edfap-1F,  // -0.769394
    0x1.10a5f2p+0F,  // 1.06503
    -0x1.a4e0fap-2F,  // -0.411014
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

}  // namespace constant
