// SPDX-License-Identifier: Apache-2.0
// The plain bit-true model against formulas written down a second time, from the paper and docs/numeric_contract.md:
// exact fractions, sums over whole windows, the map rule over a finished sequence.
#include <cmath>
#include <random>
#include <set>

#include "golden/psweep.hpp"
#include "support/catch.hpp"

using namespace psweep;
using namespace psweep::golden;

namespace {

class Random {
 public:
  explicit Random(unsigned seed) : engine_(seed) {}
  int below(int n) { return static_cast<int>(engine_() % static_cast<unsigned>(n)); }
  int between(int lo, int hi) { return lo + below(hi - lo + 1); }

 private:
  std::mt19937 engine_;
};

struct Patch {
  std::vector<int> l, r;
};
Patch random_patch(Random& random, int count, int bits, int kind) {
  Patch p;
  const int most = (1 << bits) - 1;
  for (int i = 0; i < count; ++i) {
    const int l = kind == 1   ? (random.below(2) ? most : 0)
                  : kind == 2 ? most / 2 + random.below(2)
                              : random.below(most + 1);
    p.l.push_back(l);
    p.r.push_back(kind == 0         ? (3 * l + random.below(most + 1)) / 4
                  : kind == 3       ? most - l
                  : random.below(2) ? l
                                    : most / 2);
  }
  return p;
}
Sums sums_of(const Patch& p) {
  Sums s;
  for (size_t i = 0; i < p.l.size(); ++i) s.add(p.l[i], p.r[i]);
  return s;
}

}  // namespace

TEST_CASE("a sample is floor and truncated fraction of its position") {
  Random random(1);
  for (int run = 0; run < 2000; ++run) {
    Config c;
    c.weight_bits = random.between(1, 12);
    const int32_t x = random.between(-60 * (1 << 19), 60 * (1 << 19)),
                  y = random.between(-60 * (1 << 19), 60 * (1 << 19));
    const Bounds b{random.between(-20, 5), random.between(6, 40), random.between(-20, 5), random.between(6, 40)};
    const Sample s = make_sample(c, x, y, b, 30, 25);
    // The position that remains after truncation, as a real number.
    const double unit = std::ldexp(1.0, -c.weight_bits);
    const double tx = std::floor(x / std::ldexp(1.0, 19) / unit) * unit;
    const double ty = std::floor(y / std::ldexp(1.0, 19) / unit) * unit;
    CHECK(s.xi + s.fx * unit == tx);
    CHECK(s.yi + s.fy * unit == ty);
    CHECK(s.fx >= 0);
    CHECK(s.fx < 1 << c.weight_bits);
    CHECK(s.inside_x == (tx >= b.x_lo && tx <= b.x_hi));
    CHECK(s.inside_y == (ty >= b.y_lo && ty <= b.y_hi));
    CHECK(s.in_window ==
          (std::floor(tx) >= 0 && std::floor(tx) + 1 <= 29 && std::floor(ty) >= 0 && std::floor(ty) + 1 <= 24));
  }
}

TEST_CASE("positions of a tile are start, offset and steps") {
  Config c;
  TileJob t;
  t.win_cols = t.win_rows = 100;
  t.left = t.right = {0, 98, 0, 98};
  t.tx_left = 5 << 19, t.ty_left = -(2 << 19), t.tx_right = 1 << 18, t.ty_right = 3 << 19;
  const PlaneEntry p{10 << 19, 20 << 19, 30 << 19, 40 << 19, 1 << 18, 1 << 19, 3 << 18, 2 << 19};
  CHECK(left_sample(c, t, p, 4, 7).xi == 10 + 5 + 2);
  CHECK(left_sample(c, t, p, 4, 7).yi == 20 - 2 + 7);
  const Sample r = right_sample(c, t, p, 4, 7);
  CHECK(r.xi == 30 + 6);
  CHECK(r.fx == 128);
  CHECK(r.yi == 40 + 3 + 14);
  // 32-bit registers wrap.
  CHECK(wrap_add(INT32_MAX, 1) == INT32_MIN);
}

TEST_CASE("a sample counts only if both images agree") {
  Sample in;
  in.inside_x = in.inside_y = in.in_window = true;
  int usable = 0, errors = 0;
  for (int bits = 0; bits < 64; ++bits) {
    Sample l = in, r = in;
    l.inside_x = bits & 1, l.inside_y = bits & 2, l.in_window = bits & 4;
    r.inside_x = bits & 8, r.inside_y = bits & 16, r.in_window = bits & 32;
    const SampleFlags f = sample_flags(l, r);
    const bool inside = (bits & 0b011011) == 0b011011, loaded = (bits & 0b100100) == 0b100100;
    CHECK(f.usable == (inside && loaded));
    CHECK(f.window_error == (inside && !loaded));
    usable += f.usable;
    errors += f.window_error;
  }
  CHECK(usable == 1);
  CHECK(errors == 3);
}

TEST_CASE("every 2x2 neighbourhood lies in four banks, every pixel in its own word") {
  Config c;
  c.img_cols = 12;
  c.img_rows = 8;
  std::set<std::pair<int, int>> words;
  for (int y = 0; y < c.img_rows; ++y) {
    for (int x = 0; x < c.img_cols; ++x) {
      CHECK(words.insert({bank(c, x, y), bank_address(c, x, y)}).second);
      CHECK(bank_address(c, x, y) < c.img_cols / 2 * c.img_rows / 2);
      const std::set<int> banks{bank(c, x, y), bank(c, x + 1, y), bank(c, x, y + 1), bank(c, x + 1, y + 1)};
      CHECK(banks.size() == 4);
    }
  }
}

TEST_CASE("for rectified pairs: a row's 1x2 neighbourhoods lie in two banks, every pixel in its own word") {
  Config c;
  c.img_cols = 12, c.img_rows = 8, c.rectified = 1;
  std::set<std::pair<int, int>> words;
  for (int y = 0; y < c.img_rows; ++y) {
    for (int x = 0; x < c.img_cols; ++x) {
      CHECK(words.insert({bank(c, x, y), bank_address(c, x, y)}).second);
      CHECK(bank_address(c, x, y) < c.img_cols / 2 * c.img_rows);
      CHECK(bank(c, x, y) != bank(c, x + 1, y));
      CHECK(bank(c, x, y) < 2);
    }
  }
}

TEST_CASE("interpolation is the exact bilinear form, rounded half up once") {
  Random random(2);
  for (int run = 0; run < 20000; ++run) {
    Config c;
    c.pix_bits = random.between(1, 12);
    c.weight_bits = random.between(1, 12);
    c.interp_frac = random.between(0, 8);
    const int most = (1 << c.pix_bits) - 1, one = 1 << c.weight_bits;
    auto pixel = [&] { return random.below(3) ? random.below(most + 1) : random.below(2) * most; };
    const Quad q{pixel(), pixel(), pixel(), pixel()};
    const int fx = random.below(one), fy = random.below(one);
    const int64_t exact = static_cast<int64_t>(q.p00) * (one - fx) * (one - fy) +
                          static_cast<int64_t>(q.p10) * fx * (one - fy) +
                          static_cast<int64_t>(q.p01) * (one - fx) * fy + static_cast<int64_t>(q.p11) * fx * fy;
    // At most 12 + 24 bits: exact in a double, and so is its scaling by a power of two.
    const double scaled = std::ldexp(static_cast<double>(exact), c.interp_frac - 2 * c.weight_bits);
    const int value = interpolate(c, q, fx, fy);
    CHECK(value == std::floor(scaled + 0.5));
    CHECK(value <= most << c.interp_frac);
    CHECK(value >= 0);
  }
  CHECK(interpolate(Config{}, {9, 200, 13, 77}, 0, 0) == 9 << 2);
}

TEST_CASE("division is the floor of the quotient") {
  Random random(3);
  for (int run = 0; run < 20000; ++run) {
    const int bits = random.between(1, 16);
    const int64_t den = random.between(1, 1 << random.between(1, 19));
    const int64_t num = random.below(static_cast<int>(den) + 1);
    const int64_t expected = num == den ? (int64_t{1} << bits) - 1 : (num << bits) / den;
    CHECK(divide_fraction(num, den, bits) == expected);
  }
}

TEST_CASE("normalisation shifts both operands alike") {
  Random random(4);
  for (int run = 0; run < 5000; ++run) {
    const int norm = random.between(7, 19);
    const int64_t den0 = 1 + static_cast<int64_t>(std::ldexp(random.below(1 << 30), random.between(-29, 18)));
    const int64_t num0 = den0 / (1 + random.below(9));
    int64_t num = num0, den = den0;
    normalise(num, den, norm);
    CHECK(den >> (norm - 1) == 1);
    const int shift = static_cast<int>(std::floor(std::log2(static_cast<double>(den0)))) - (norm - 1);
    CHECK(static_cast<double>(den) == std::floor(std::ldexp(static_cast<double>(den0), -shift)));
    CHECK(static_cast<double>(num) == std::floor(std::ldexp(static_cast<double>(num0), -shift)));
  }
}

TEST_CASE("V is the paper's MNCC") {
  Random random(5);
  int positive = 0, zero = 0;
  for (int run = 0; run < 3000; ++run) {
    Config c;
    c.window = 3 + 2 * random.below(10);
    c.interp_frac = random.below(5);
    c.mncc_bits = random.between(4, 16);
    const int n = c.window * c.window, kind = random.below(4);
    const Patch p = random_patch(random, n, c.sample_bits(), kind);
    // Equation 1, in doubles: 2 cov / (var + var), two passes.
    double ml = 0, mr = 0, cov = 0, vl = 0, vr = 0;
    for (int i = 0; i < n; ++i) ml += p.l[i], mr += p.r[i];
    ml /= n, mr /= n;
    for (int i = 0; i < n; ++i) {
      cov += (p.l[i] - ml) * (p.r[i] - mr);
      vl += (p.l[i] - ml) * (p.l[i] - ml);
      vr += (p.r[i] - mr) * (p.r[i] - mr);
    }
    const Similarity s = mncc(c, sums_of(p), true);
    CHECK(s.valid);
    CHECK(s.textured == (vl + vr > 1e-9));
    if (!s.textured) continue;
    // Truncated operands of mncc_bits + 3 bits move the quotient by less than a quarter unit, truncation by one.
    const double full = std::ldexp(1.0, c.mncc_bits), exact = std::max(0.0, 2 * cov / (vl + vr)) * full;
    CHECK(s.v <= exact + 0.2500001);
    CHECK(s.v > std::min(exact, full - 1) - 1.2500001);
    positive += s.v > 0;
    zero += s.v == 0;
    // It does not change with a common offset, with the order of the images, or with both negated.
    Patch offset = p, swapped{p.r, p.l}, negated = p;
    for (int i = 0; i < n; ++i) {
      offset.l[i] += 37, offset.r[i] += 37;
      negated.l[i] = -p.l[i], negated.r[i] = -p.r[i];
    }
    CHECK(mncc(c, sums_of(offset), true).v == s.v);
    CHECK(mncc(c, sums_of(swapped), true).v == s.v);
    CHECK(mncc(c, sums_of(negated), true).v == s.v);
    CHECK(mncc(c, sums_of({p.l, p.l}), true).v == ((1 << c.mncc_bits) - 1) * (vl > 1e-9));
    const Similarity invalid = mncc(c, sums_of(p), false);
    CHECK(invalid.v == 0);
    CHECK(!invalid.valid);
    CHECK(!invalid.textured);
  }
  CHECK(positive > 500);
  CHECK(zero > 100);
  Config c;
  const Similarity flat = mncc(c, sums_of({std::vector<int>(169, 700), std::vector<int>(169, 3)}), true);
  CHECK(flat.valid);
  CHECK(!flat.textured);
  CHECK(flat.v == 0);
}

TEST_CASE("largest sums of every window and sample width fit") {
  for (int m = 3; m <= 21; m += 2) {
    for (int bits = 1; bits <= 20; ++bits) {
      Config c;
      c.window = m;
      c.pix_bits = std::min(bits, 12);
      c.interp_frac = bits - c.pix_bits;
      c.mncc_bits = 16;
      const int n = m * m, most = (1 << bits) - 1;
      Patch p;
      for (int i = 0; i < n; ++i) p.l.push_back(i % 2 ? most : 0);
      p.r = p.l;
      CHECK(mncc(c, sums_of(p), true).v == 65535);
      for (auto& v : p.r) v = most - v;
      CHECK(mncc(c, sums_of(p), true).v == 0);
      CHECK(mncc(c, sums_of(p), true).textured);
    }
  }
}

TEST_CASE("the map holds the first best plane, its parabola and the right reason") {
  Random random(6);
  size_t kinds[16] = {};
  for (int run = 0; run < 40000; ++run) {
    Config c;
    c.mncc_bits = random.between(4, 16);
    c.frac_bits = random.between(2, 12);
    const int planes = random.between(1, 12);
    // Few distinct values, so that ties and plateaus are common.
    const int most = (1 << c.mncc_bits) - 1, levels = random.between(1, 6);
    std::vector<Similarity> s(static_cast<size_t>(planes));
    for (auto& x : s) {
      x.valid = random.below(8) != 0;
      x.textured = x.valid && random.below(4) != 0;
      x.v = x.textured ? random.below(levels + 1) * most / (levels + 1) : 0;
      if (run % 5 == 0) x = Similarity{0, x.valid && run % 10 == 0, false};
      if (run % 7 == 0) x.v = x.textured = 0;
    }
    Cell cell;
    cell.best = 3, cell.frac = 7, cell.local_max = true;  // left over from another tile: plane 0 must clear it
    for (int k = 0; k < planes; ++k) cell = update(c, cell, k, s[static_cast<size_t>(k)]);
    const int threshold = random.below(most + 1);
    const MapCell m = unload(cell, threshold);

    // The same from the finished sequence.
    auto value = [&](int k) { return k >= 0 && k < planes ? s[static_cast<size_t>(k)].v : 0; };
    auto inside = [&](int k) { return k >= 0 && k < planes && s[static_cast<size_t>(k)].valid; };
    bool any_inside = false, any_texture = false;
    int best = 0, plane = 0;
    for (int k = 0; k < planes; ++k) {
      any_inside = any_inside || inside(k);
      any_texture = any_texture || s[static_cast<size_t>(k)].textured;
      if (value(k) > best) best = value(k), plane = k;
    }
    MapCell expected;
    expected.v = static_cast<uint16_t>(best);
    expected.plane = static_cast<uint16_t>(plane);
    if (best == 0) {
      expected.frac = static_cast<uint16_t>((any_inside ? 1 : 0) + (any_texture ? 2 : 0));
      expected.mask = !any_inside ? kMaskOutside : !any_texture ? kMaskNoVariance : kMaskNotLocal;
      if (any_texture && 0 < threshold) expected.mask |= kMaskBelow;
    } else {
      const int a = best - value(plane - 1), b = best - value(plane + 1);
      if (plane + 1 < planes) {
        expected.frac =
            static_cast<uint16_t>(b == 0 ? (1 << c.frac_bits) - 1 : (static_cast<int64_t>(a) << c.frac_bits) / (a + b));
      }
      if (best < threshold) expected.mask |= kMaskBelow;
      if (!inside(plane - 1) || !inside(plane + 1)) expected.mask |= kMaskNotLocal;
    }
    ++kinds[expected.mask];
    if (m != expected) {
      FAIL_CHECK("run " << run << ": plane " << m.plane << "/" << expected.plane << " frac " << m.frac << "/"
                        << expected.frac << " v " << m.v << "/" << expected.v << " mask " << int{m.mask} << "/"
                        << int{expected.mask});
    }
  }
  for (const int mask : {0, 1, 2, 4, 8, 12}) CHECK(kinds[mask] > 100);
}

TEST_CASE("running sums equal plain sums over every window") {
  Random random(7);
  Config c;
  c.window = 5;
  TileJob t;
  t.tile_cols = 17, t.tile_rows = 9;
  t.win_cols = 24, t.win_rows = 16;
  t.left = {0, 17, 0, 14};
  t.right = {0, 22, 0, 14};
  const PlaneEntry p{1 << 18, 1 << 17, 1 << 19, 0, (1 << 19) + 999, 1 << 19, 1 << 19, (1 << 19) - 5000};
  Pixels left(t.win_cols, t.win_rows), right(t.win_cols, t.win_rows);
  for (auto& v : left.data) v = static_cast<uint16_t>(random.below(256));
  for (auto& v : right.data) v = static_cast<uint16_t>(random.below(256));
  const PlaneTrace trace = sweep_plane(c, t, p, left, right);
  const int cols = sweep_cols(c, t);
  REQUIRE(trace.l.size() == static_cast<size_t>(cols) * sweep_rows(c, t));
  REQUIRE(trace.similarity.size() == static_cast<size_t>(t.tile_cols) * t.tile_rows);
  int valid_cells = 0, invalid_cells = 0;
  for (int v = 0; v < t.tile_rows; ++v) {
    for (int u = 0; u < t.tile_cols; ++u) {
      Sums sums;
      bool valid = true;
      for (int j = v; j < v + c.window; ++j) {
        for (int i = u; i < u + c.window; ++i) {
          const size_t at = static_cast<size_t>(j) * cols + i;
          sums.add(trace.l[at], trace.r[at]);
          valid = valid && trace.flags[at].usable;
          if (!trace.flags[at].usable) CHECK((trace.l[at] == 0 && trace.r[at] == 0));
        }
      }
      const Similarity expected = mncc(c, sums, valid);
      const Similarity& s = trace.similarity[static_cast<size_t>(v) * t.tile_cols + u];
      CHECK(s.v == expected.v);
      CHECK(s.valid == expected.valid);
      CHECK(s.textured == expected.textured);
      ++(valid ? valid_cells : invalid_cells);
    }
  }
  CHECK(valid_cells > 20);
  CHECK(invalid_cells > 20);
}

TEST_CASE("width of the plane index") {
  Config c;
  for (const auto& [planes, bits] :
       std::vector<std::pair<int, int>>{{1, 1}, {2, 1}, {3, 2}, {256, 8}, {257, 9}, {301, 9}, {1024, 10}}) {
    c.planes = planes;
    CHECK(c.plane_bits() == bits);
  }
}
