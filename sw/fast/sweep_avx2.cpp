// SPDX-License-Identifier: Apache-2.0
// 8 lanes of AVX2 with FMA. Contract: sweep.hpp; algorithm: sweep_simd.inc.
#include <immintrin.h>

#include "fast/sweep.hpp"

namespace psweep::fast {
namespace {

#include "fast/sweep_raster.inc"

struct Lanes {
  static constexpr int kLanes = 8;
  using I = __m256i;
  using Count = __m128i;
  static I zero() { return _mm256_setzero_si256(); }
  static I load(const int32_t* p) { return _mm256_load_si256(reinterpret_cast<const I*>(p)); }
  static void store(int32_t* p, I a) { _mm256_store_si256(reinterpret_cast<I*>(p), a); }
  static I add(I a, I b) { return _mm256_add_epi32(a, b); }
  static I sub(I a, I b) { return _mm256_sub_epi32(a, b); }
  static I add16(I a, I b) { return _mm256_add_epi16(a, b); }
  static I sub16(I a, I b) { return _mm256_sub_epi16(a, b); }
  static I mul16(I a, I b) { return _mm256_mullo_epi16(a, b); }
  static I madd(I a, I b) { return _mm256_madd_epi16(a, b); }
  static I high_to_low(I a) { return _mm256_srli_epi32(a, 16); }
  static I shift_right16(I a, Count n) { return _mm256_sra_epi16(a, n); }
  static Count count(int n) { return _mm_cvtsi32_si128(n); }
  static I pair(int low, int high) { return _mm256_set1_epi32((low & 0xFFFF) | high * 65536); }
  static I load_pixels(const uint8_t* left, const uint8_t* right) {
    const I l = _mm256_cvtepu8_epi32(_mm_loadl_epi64(reinterpret_cast<const __m128i*>(left)));
    const I r = _mm256_cvtepu8_epi32(_mm_loadl_epi64(reinterpret_cast<const __m128i*>(right)));
    return _mm256_or_si256(l, _mm256_slli_epi32(r, 16));
  }
  // Bit per lane: lo <= index < hi (indices fit 16 bits signed but for 0xFFFF, which is never in range).
  static unsigned in_range(const uint16_t* index, int lo, int hi) {
    const I i = _mm256_cvtepu16_epi32(_mm_load_si128(reinterpret_cast<const __m128i*>(index)));
    const I in = _mm256_and_si256(_mm256_cmpgt_epi32(i, _mm256_set1_epi32(lo - 1)),
                                  _mm256_cmpgt_epi32(_mm256_set1_epi32(hi), i));
    return static_cast<unsigned>(_mm256_movemask_ps(_mm256_castsi256_ps(in)));
  }
};

// floor(num * 2^bits / den) for 0 <= num <= den < 2^20, den > 0; all ones for num = den. The float quotient is rounded,
// so it may have reached the next integer: the sign of the exactly computed remainder tells.
__m256i divide(__m256 num, __m256 den, __m256 scale, __m256i ones) {
  const __m256 scaled = _mm256_mul_ps(num, scale);
  const __m256 q = _mm256_round_ps(_mm256_div_ps(scaled, den), _MM_FROUND_TO_ZERO | _MM_FROUND_NO_EXC);
  const __m256 high = _mm256_cmp_ps(_mm256_fnmadd_ps(q, den, scaled), _mm256_setzero_ps(), _CMP_LT_OQ);
  return _mm256_min_epi32(_mm256_add_epi32(_mm256_cvttps_epi32(q), _mm256_castps_si256(high)), ones);
}

// From window sums to V. Numerator and denominator are exact in doubles (below 2^53); a power of two made from the
// denominator's exponent brings its leading one to the top of the divider's operands, and truncation does the rest.
struct Mncc {
  __m256d n, one;
  __m256i exponent, top;
  __m256 scale;
  __m256i ones;

  explicit Mncc(const Band& b) {
    n = _mm256_set1_pd(static_cast<double>(b.window) * b.window);
    one = _mm256_set1_pd(1.0);
    exponent = _mm256_set1_epi64x(int64_t{0x7FF} << 52);
    top = _mm256_set1_epi64x(static_cast<int64_t>(static_cast<uint64_t>(b.mncc_bits + 2 + 2046) << 52));
    scale = _mm256_set1_ps(static_cast<float>(1 << b.mncc_bits));
    ones = _mm256_set1_epi32((1 << b.mncc_bits) - 1);
  }
  void operands(__m128i wl, __m128i wr, __m128i wlr, __m128i wss, __m128i& num, __m128i& den, unsigned& texture) const {
    const __m256d l = _mm256_cvtepi32_pd(wl), r = _mm256_cvtepi32_pd(wr);
    const __m256d lr = _mm256_cvtepi32_pd(wlr), ss = _mm256_cvtepi32_pd(wss);
    const __m256d half_num = _mm256_fnmadd_pd(l, r, _mm256_mul_pd(n, lr));
    __m256d d = _mm256_fnmadd_pd(l, l, _mm256_fnmadd_pd(r, r, _mm256_mul_pd(n, ss)));
    texture = static_cast<unsigned>(_mm256_movemask_pd(_mm256_cmp_pd(d, one, _CMP_GE_OQ)));  // an integer
    d = _mm256_max_pd(d, one);
    const __m256d up = _mm256_castsi256_pd(_mm256_sub_epi64(top, _mm256_and_si256(_mm256_castpd_si256(d), exponent)));
    den = _mm256_cvttpd_epi32(_mm256_mul_pd(d, up));
    num = _mm256_cvttpd_epi32(_mm256_mul_pd(_mm256_add_pd(half_num, half_num), up));
  }
  void store(uint16_t* v, __m256i wl, __m256i wr, __m256i wlr, __m256i wss, unsigned& texture) const {
    __m128i num0, den0, num1, den1;
    unsigned texture0, texture1;
    operands(_mm256_castsi256_si128(wl), _mm256_castsi256_si128(wr), _mm256_castsi256_si128(wlr),
             _mm256_castsi256_si128(wss), num0, den0, texture0);
    operands(_mm256_extracti128_si256(wl, 1), _mm256_extracti128_si256(wr, 1), _mm256_extracti128_si256(wlr, 1),
             _mm256_extracti128_si256(wss, 1), num1, den1, texture1);
    texture = texture0 | texture1 << 4;
    const __m256i num = _mm256_max_epi32(_mm256_set_m128i(num1, num0), _mm256_setzero_si256());
    const __m256i q = divide(_mm256_cvtepi32_ps(num), _mm256_cvtepi32_ps(_mm256_set_m128i(den1, den0)), scale, ones);
    _mm_store_si128(reinterpret_cast<__m128i*>(v),
                    _mm_packus_epi32(_mm256_castsi256_si128(q), _mm256_extracti128_si256(q, 1)));
  }
};

__m256i parabola_half(__m128i before, __m128i best, __m128i after, __m256 scale, __m256i ones) {
  const __m256i peak = _mm256_cvtepu16_epi32(best);
  const __m256i a = _mm256_sub_epi32(peak, _mm256_cvtepu16_epi32(before));
  const __m256i c = _mm256_sub_epi32(peak, _mm256_cvtepu16_epi32(after));
  return divide(_mm256_cvtepi32_ps(a), _mm256_cvtepi32_ps(_mm256_add_epi32(a, c)), scale, ones);
}
// frac of 16 cells; lanes that are not due hold nonsense, but no trap.
__m256i parabola(__m256i before, __m256i best, __m256i after, int frac_bits) {
  const __m256 scale = _mm256_set1_ps(static_cast<float>(1 << frac_bits));
  const __m256i ones = _mm256_set1_epi32((1 << frac_bits) - 1);
  const __m256i low = parabola_half(_mm256_castsi256_si128(before), _mm256_castsi256_si128(best),
                                    _mm256_castsi256_si128(after), scale, ones);
  const __m256i high = parabola_half(_mm256_extracti128_si256(before, 1), _mm256_extracti128_si256(best, 1),
                                     _mm256_extracti128_si256(after, 1), scale, ones);
  return _mm256_permute4x64_epi64(_mm256_packus_epi32(low, high), 0xD8);
}

// Map words of 16 cells at a time; masks are 16-bit lanes of all ones or zero.
void update_row(const Band& b, int row, int k, int u_lo, int u_hi) {
  using I = __m256i;
  const size_t first = static_cast<size_t>(row) * b.row_len;
  const I lo = _mm256_set1_epi16(static_cast<int16_t>(u_lo));
  const I last = _mm256_set1_epi16(static_cast<int16_t>(u_hi - u_lo - 1));
  const I some = _mm256_set1_epi16(u_hi > u_lo ? -1 : 0);
  const I before = _mm256_set1_epi16(static_cast<int16_t>(k - 1));
  const I now = _mm256_set1_epi16(static_cast<int16_t>(k));
  const I one = _mm256_set1_epi16(kPrevValid), two = _mm256_set1_epi16(kLocalMax);
  auto at = [&](uint16_t* p, int i) { return reinterpret_cast<I*>(p + first + i); };
  for (int i = 0; i < b.row_len; i += 16) {
    const I index = _mm256_sub_epi16(_mm256_load_si256(reinterpret_cast<const I*>(b.cell_index + i)), lo);
    const I valid = _mm256_and_si256(some, _mm256_cmpeq_epi16(_mm256_min_epu16(index, last), index));
    const I v = _mm256_and_si256(valid, _mm256_load_si256(reinterpret_cast<const I*>(b.v + i)));
    const I best = _mm256_load_si256(at(b.best, i)), prev = _mm256_load_si256(at(b.prev, i));
    const I plane = _mm256_load_si256(at(b.plane, i)), frac = _mm256_load_si256(at(b.frac, i));
    const I flags = _mm256_load_si256(at(b.flags, i));
    const I prev_valid = _mm256_cmpeq_epi16(_mm256_and_si256(flags, one), one);
    const I local_max = _mm256_cmpeq_epi16(_mm256_and_si256(flags, two), two);
    const I new_best = _mm256_max_epu16(v, best);
    const I keep = _mm256_cmpeq_epi16(new_best, best);
    const I adjacent = _mm256_cmpeq_epi16(plane, before);
    const I due = _mm256_and_si256(adjacent, keep);
    I new_frac = _mm256_and_si256(keep, frac);
    if (!_mm256_testz_si256(due, due)) {
      new_frac = _mm256_blendv_epi8(new_frac, parabola(prev, best, v, b.frac_bits), due);
    }
    _mm256_store_si256(at(b.frac, i), new_frac);
    _mm256_store_si256(at(b.best, i), new_best);
    _mm256_store_si256(at(b.plane, i), _mm256_blendv_epi8(now, plane, keep));
    _mm256_store_si256(at(b.prev, i), _mm256_blendv_epi8(_mm256_blendv_epi8(prev, best, adjacent), v, keep));
    const I new_valid = _mm256_blendv_epi8(_mm256_or_si256(adjacent, prev_valid), valid, keep);
    const I new_max = _mm256_and_si256(keep, _mm256_blendv_epi8(local_max, _mm256_and_si256(valid, prev_valid), due));
    _mm256_store_si256(at(b.flags, i),
                       _mm256_or_si256(_mm256_and_si256(new_valid, one), _mm256_and_si256(new_max, two)));
  }
}

#include "fast/sweep_simd.inc"

}  // namespace

const SweepLevel kStridedAvx2 = {Lanes::kLanes, sweep_strided, local_max_raster};
const SweepLevel kRasterAvx2 = {1, sweep_raster, local_max_raster};

}  // namespace psweep::fast
