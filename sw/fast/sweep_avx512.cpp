// SPDX-License-Identifier: Apache-2.0
// 16 lanes of AVX-512 (F, BW, DQ, VL). Contract: sweep.hpp; algorithm: sweep_simd.inc.
#include <immintrin.h>

#include "fast/sweep.hpp"

namespace psweep::fast {
namespace {

#include "fast/sweep_raster.inc"

struct Lanes {
  static constexpr int kLanes = 16;
  using I = __m512i;
  using Count = __m128i;
  static I zero() { return _mm512_setzero_si512(); }
  static I load(const int32_t* p) { return _mm512_load_si512(p); }
  static void store(int32_t* p, I a) { _mm512_store_si512(p, a); }
  static I add(I a, I b) { return _mm512_add_epi32(a, b); }
  static I sub(I a, I b) { return _mm512_sub_epi32(a, b); }
  static I add16(I a, I b) { return _mm512_add_epi16(a, b); }
  static I sub16(I a, I b) { return _mm512_sub_epi16(a, b); }
  static I mul16(I a, I b) { return _mm512_mullo_epi16(a, b); }
  static I madd(I a, I b) { return _mm512_madd_epi16(a, b); }
  static I high_to_low(I a) { return _mm512_srli_epi32(a, 16); }
  static I shift_right16(I a, Count n) { return _mm512_sra_epi16(a, n); }
  static Count count(int n) { return _mm_cvtsi32_si128(n); }
  static I pair(int low, int high) { return _mm512_set1_epi32((low & 0xFFFF) | high * 65536); }
  static I load_pixels(const uint8_t* left, const uint8_t* right) {
    const I l = _mm512_cvtepu8_epi32(_mm_load_si128(reinterpret_cast<const __m128i*>(left)));
    const I r = _mm512_cvtepu8_epi32(_mm_load_si128(reinterpret_cast<const __m128i*>(right)));
    return _mm512_or_si512(l, _mm512_slli_epi32(r, 16));
  }
  // Bit per lane: lo <= index < hi.
  static unsigned in_range(const uint16_t* index, int lo, int hi) {
    const __m256i i = _mm256_load_si256(reinterpret_cast<const __m256i*>(index));
    return _mm256_cmplt_epu16_mask(_mm256_sub_epi16(i, _mm256_set1_epi16(static_cast<int16_t>(lo))),
                                   _mm256_set1_epi16(static_cast<int16_t>(hi - lo)));
  }
};

// floor(num * 2^bits / den) for 0 <= num <= den < 2^20, den > 0; all ones for num = den. The float quotient is rounded,
// so it may have reached the next integer: the sign of the exactly computed remainder tells.
__m512i divide(__m512 num, __m512 den, __m512 scale, __m512i ones) {
  const __m512 scaled = _mm512_mul_ps(num, scale);
  const __m512 q = _mm512_roundscale_ps(_mm512_div_ps(scaled, den), _MM_FROUND_TO_ZERO | _MM_FROUND_NO_EXC);
  const __mmask16 high = _mm512_cmp_ps_mask(_mm512_fnmadd_ps(q, den, scaled), _mm512_setzero_ps(), _CMP_LT_OQ);
  const __m512i quotient = _mm512_cvttps_epi32(q);
  return _mm512_min_epi32(_mm512_mask_sub_epi32(quotient, high, quotient, _mm512_set1_epi32(1)), ones);
}

// From window sums to V. Numerator and denominator are exact in doubles (below 2^53); a power of two made from the
// denominator's exponent brings its leading one to the top of the divider's operands, and truncation does the rest.
struct Mncc {
  __m512d n, one;
  __m512i exponent, top;
  __m512 scale;
  __m512i ones;

  explicit Mncc(const Band& b) {
    n = _mm512_set1_pd(static_cast<double>(b.window) * b.window);
    one = _mm512_set1_pd(1.0);
    exponent = _mm512_set1_epi64(int64_t{0x7FF} << 52);
    top = _mm512_set1_epi64(static_cast<int64_t>(static_cast<uint64_t>(b.mncc_bits + 2 + 2046) << 52));
    scale = _mm512_set1_ps(static_cast<float>(1 << b.mncc_bits));
    ones = _mm512_set1_epi32((1 << b.mncc_bits) - 1);
  }
  void operands(__m256i wl, __m256i wr, __m256i wlr, __m256i wss, __m256i& num, __m256i& den, unsigned& texture) const {
    const __m512d l = _mm512_cvtepi32_pd(wl), r = _mm512_cvtepi32_pd(wr);
    const __m512d lr = _mm512_cvtepi32_pd(wlr), ss = _mm512_cvtepi32_pd(wss);
    const __m512d half_num = _mm512_fnmadd_pd(l, r, _mm512_mul_pd(n, lr));
    __m512d d = _mm512_fnmadd_pd(l, l, _mm512_fnmadd_pd(r, r, _mm512_mul_pd(n, ss)));
    texture = _mm512_cmp_pd_mask(d, one, _CMP_GE_OQ);  // an integer
    d = _mm512_max_pd(d, one);
    const __m512d half_up =
        _mm512_castsi512_pd(_mm512_sub_epi64(top, _mm512_and_si512(_mm512_castpd_si512(d), exponent)));
    den = _mm512_cvttpd_epi32(_mm512_mul_pd(d, half_up));
    num = _mm512_cvttpd_epi32(_mm512_mul_pd(_mm512_add_pd(half_num, half_num), half_up));
  }
  void store(uint16_t* v, __m512i wl, __m512i wr, __m512i wlr, __m512i wss, unsigned& texture) const {
    __m256i num0, den0, num1, den1;
    unsigned texture0, texture1;
    operands(_mm512_castsi512_si256(wl), _mm512_castsi512_si256(wr), _mm512_castsi512_si256(wlr),
             _mm512_castsi512_si256(wss), num0, den0, texture0);
    operands(_mm512_extracti64x4_epi64(wl, 1), _mm512_extracti64x4_epi64(wr, 1), _mm512_extracti64x4_epi64(wlr, 1),
             _mm512_extracti64x4_epi64(wss, 1), num1, den1, texture1);
    texture = texture0 | texture1 << 8;
    const __m512i num = _mm512_inserti64x4(_mm512_castsi256_si512(num0), num1, 1);
    const __m512i den = _mm512_inserti64x4(_mm512_castsi256_si512(den0), den1, 1);
    const __m512 positive = _mm512_cvtepi32_ps(_mm512_max_epi32(num, _mm512_setzero_si512()));
    const __m512i q = divide(positive, _mm512_cvtepi32_ps(den), scale, ones);
    _mm256_store_si256(reinterpret_cast<__m256i*>(v), _mm512_cvtepi32_epi16(q));
  }
};

__m512i parabola_half(__m256i before, __m256i best, __m256i after, __m512 scale, __m512i ones) {
  const __m512i peak = _mm512_cvtepu16_epi32(best);
  const __m512i a = _mm512_sub_epi32(peak, _mm512_cvtepu16_epi32(before));
  const __m512i c = _mm512_sub_epi32(peak, _mm512_cvtepu16_epi32(after));
  return divide(_mm512_cvtepi32_ps(a), _mm512_cvtepi32_ps(_mm512_add_epi32(a, c)), scale, ones);
}
// frac of 32 cells; lanes that are not due hold nonsense, but no trap.
__m512i parabola(__m512i before, __m512i best, __m512i after, int frac_bits) {
  const __m512 scale = _mm512_set1_ps(static_cast<float>(1 << frac_bits));
  const __m512i ones = _mm512_set1_epi32((1 << frac_bits) - 1);
  const __m512i low = parabola_half(_mm512_castsi512_si256(before), _mm512_castsi512_si256(best),
                                    _mm512_castsi512_si256(after), scale, ones);
  const __m512i high = parabola_half(_mm512_extracti64x4_epi64(before, 1), _mm512_extracti64x4_epi64(best, 1),
                                     _mm512_extracti64x4_epi64(after, 1), scale, ones);
  return _mm512_inserti64x4(_mm512_castsi256_si512(_mm512_cvtepi32_epi16(low)), _mm512_cvtepi32_epi16(high), 1);
}

// Map words of 32 cells at a time. Flags of 32 cells: two 32-bit masks, "previous plane valid" and "local maximum", in
// the first two words' places.
void update_row(const Band& b, int row, int k, int u_lo, int u_hi) {
  const size_t first = static_cast<size_t>(row) * b.row_len;
  const __m512i lo = _mm512_set1_epi16(static_cast<int16_t>(u_lo));
  const __m512i count = _mm512_set1_epi16(static_cast<int16_t>(u_hi - u_lo));
  const __m512i before = _mm512_set1_epi16(static_cast<int16_t>(k - 1));
  const __m512i now = _mm512_set1_epi16(static_cast<int16_t>(k));
  for (int i = 0; i < b.row_len; i += 32) {
    uint16_t* best_at = b.best + first + i;
    uint16_t* prev_at = b.prev + first + i;
    uint16_t* plane_at = b.plane + first + i;
    uint16_t* frac_at = b.frac + first + i;
    uint32_t flags[2];
    __builtin_memcpy(flags, b.flags + first + i, sizeof flags);
    const uint32_t prev_valid = flags[0], local_max = flags[1];
    const __mmask32 valid = _mm512_cmplt_epu16_mask(_mm512_sub_epi16(_mm512_load_si512(b.cell_index + i), lo), count);
    const __m512i v = _mm512_maskz_mov_epi16(valid, _mm512_load_si512(b.v + i));
    const __m512i best = _mm512_load_si512(best_at), prev = _mm512_load_si512(prev_at);
    const __m512i plane = _mm512_load_si512(plane_at), frac = _mm512_load_si512(frac_at);
    const __mmask32 adjacent = _mm512_cmpeq_epi16_mask(plane, before);
    const __mmask32 take = _mm512_cmpgt_epu16_mask(v, best);
    const __mmask32 due = adjacent & ~take;
    __m512i new_frac = _mm512_maskz_mov_epi16(~take, frac);
    if (due) new_frac = _mm512_mask_mov_epi16(new_frac, due, parabola(prev, best, v, b.frac_bits));
    _mm512_store_si512(frac_at, new_frac);
    _mm512_store_si512(best_at, _mm512_max_epu16(best, v));
    _mm512_store_si512(plane_at, _mm512_mask_mov_epi16(plane, take, now));
    const __m512i kept = _mm512_mask_mov_epi16(prev, adjacent, best);
    _mm512_store_si512(prev_at, _mm512_mask_mov_epi16(v, take, kept));
    flags[0] = (take & (adjacent | prev_valid)) | (~take & valid);
    flags[1] = (due & valid & prev_valid) | (~take & ~due & local_max);
    __builtin_memcpy(b.flags + first + i, flags, sizeof flags);
  }
}

bool local_max(const Band& b, size_t at) {
  uint32_t mask;
  __builtin_memcpy(&mask, b.flags + at / 32 * 32 + 2, sizeof mask);
  return (mask >> (at % 32)) & 1;
}

#include "fast/sweep_simd.inc"

}  // namespace

const SweepLevel kStridedAvx512 = {Lanes::kLanes, sweep_strided, local_max};
const SweepLevel kRasterAvx512 = {1, sweep_raster, local_max_raster};

}  // namespace psweep::fast
