// SPDX-License-Identifier: Apache-2.0
#include "io/picture.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>
#include <opencv2/imgproc.hpp>

namespace psweep {
namespace {

const cv::Vec3b kHole(56, 52, 48);      // no result
const cv::Vec3b kPaper(255, 255, 255);  // around the picture
const cv::Scalar kInk(40, 36, 32);      // text and ticks
constexpr int kBarWidth = 18, kMargin = 14, kLabelWidth = 62;

// 256 colours of an OpenCV colour map.
std::vector<cv::Vec3b> palette(int map) {
  cv::Mat ramp(1, 256, CV_8UC1), colours;
  for (int i = 0; i < 256; ++i) ramp.at<uint8_t>(0, i) = static_cast<uint8_t>(i);
  cv::applyColorMap(ramp, colours, map);
  return {colours.begin<cv::Vec3b>(), colours.end<cv::Vec3b>()};
}

const cv::Vec3b& colour(const std::vector<cv::Vec3b>& table, double share) {
  return table[static_cast<size_t>(std::clamp(share, 0.0, 1.0) * 255 + 0.5)];
}

struct Tick {
  double share;  // 0 bottom, 1 top of the bar
  std::string label;
};

// Round numbers inside lo .. hi, about `count` of them. (+ 0.0 turns -0 into 0.)
std::vector<double> round_numbers(double lo, double hi, int count) {
  const double raw = (hi - lo) / count;
  const double decade = std::pow(10, std::floor(std::log10(raw)));
  double step = decade * 10;
  for (const double m : {5.0, 2.0, 1.0}) {
    if (decade * m >= raw * 0.999) step = decade * m;
  }
  std::vector<double> out;
  for (double k = std::ceil(lo / step - 1e-9) + 0.0; k * step <= hi * (1 + 1e-9); k += 1) out.push_back(k * step);
  return out;
}

std::string label(double v) {
  char text[32];
  std::snprintf(text, sizeof text, "%g", std::round(v * 1e6) / 1e6);
  return text;
}

// The picture on white, with a colour bar on its right.
cv::Mat with_bar(const cv::Mat& picture, const std::vector<cv::Vec3b>& table, bool reversed, std::vector<Tick> ticks,
                 const std::string& unit) {
  const int font = cv::FONT_HERSHEY_SIMPLEX;
  const double size = 0.42;
  const int rows = std::max(picture.rows, 120);
  cv::Mat out(rows, picture.cols + kMargin + kBarWidth + kLabelWidth, CV_8UC3, kPaper);
  picture.copyTo(out(cv::Rect(0, 0, picture.cols, picture.rows)));
  const int left = picture.cols + kMargin, top = 26, bottom = rows - 10;
  for (int y = top; y <= bottom; ++y) {
    double share = static_cast<double>(bottom - y) / (bottom - top);
    if (reversed) share = 1 - share;
    for (int x = 0; x < kBarWidth; ++x) out.at<cv::Vec3b>(y, left + x) = colour(table, share);
  }
  cv::rectangle(out, cv::Point(left - 1, top - 1), cv::Point(left + kBarWidth, bottom + 1), kInk, 1);
  cv::putText(out, unit, cv::Point(left, 14), font, size, kInk, 1, cv::LINE_AA);
  std::sort(ticks.begin(), ticks.end(), [](const Tick& a, const Tick& b) { return a.share < b.share; });
  int last = 1 << 30;
  for (const auto& tick : ticks) {
    const int y = static_cast<int>(std::lround(bottom - tick.share * (bottom - top)));
    if (y < top || y > bottom || last - y < 15) continue;  // labels must not overlap
    last = y;
    cv::line(out, cv::Point(left + kBarWidth, y), cv::Point(left + kBarWidth + 4, y), kInk, 1);
    cv::putText(out, tick.label, cv::Point(left + kBarWidth + 9, std::clamp(y + 4, 10, rows - 3)), font, size, kInk, 1,
                cv::LINE_AA);
  }
  return out;
}

}  // namespace

cv::Mat depth_picture(const FloatImage& depth, const PlaneSpacing& range, bool metric, double focal_baseline) {
  const auto table = palette(cv::COLORMAP_TURBO);
  const double span = std::max(1e-9, std::log(range.zmax / range.zmin));
  const auto far_share = [&](double z) { return std::log(z / range.zmin) / span; };
  cv::Mat out(depth.height, depth.width, CV_8UC3, kHole);
  for (int y = 0; y < depth.height; ++y) {
    for (int x = 0; x < depth.width; ++x) {
      const double z = depth.at(x, y);
      if (std::isfinite(z)) out.at<cv::Vec3b>(y, x) = colour(table, 1 - far_share(z));
    }
  }
  std::vector<Tick> ticks;
  if (metric) {
    for (const double z : round_numbers(range.zmin, range.zmax, 7)) ticks.push_back({far_share(z), label(z)});
  } else {
    for (const double d : round_numbers(focal_baseline / range.zmax, focal_baseline / range.zmin, 7)) {
      if (d > 0) ticks.push_back({far_share(focal_baseline / d), label(d)});
    }
  }
  return with_bar(out, table, true, ticks, metric ? "depth, m" : "disp., px");
}

cv::Mat error_picture(const FloatImage& value, const FloatImage& truth, double scale, double full,
                      const std::string& unit) {
  const auto table = palette(cv::COLORMAP_INFERNO);
  cv::Mat out(value.height, value.width, CV_8UC3, cv::Scalar(226, 226, 226));
  for (int y = 0; y < value.height; ++y) {
    for (int x = 0; x < value.width; ++x) {
      if (!std::isfinite(truth.at(x, y))) continue;
      const double v = value.at(x, y);
      out.at<cv::Vec3b>(y, x) =
          std::isfinite(v) ? colour(table, std::abs(v - truth.at(x, y)) * scale / full) : cv::Vec3b(190, 120, 40);
    }
  }
  std::vector<Tick> ticks;
  for (const double e : round_numbers(0, full, 5)) ticks.push_back({e / full, (e >= full ? ">" : "") + label(e)});
  return with_bar(out, table, false, ticks, "error, " + unit);
}

cv::Mat cloud_picture(const std::vector<CloudPoint>& points, const PlaneSpacing& range, int width, int height) {
  const auto table = palette(cv::COLORMAP_TURBO);
  constexpr int kSuper = 2;  // drawn at twice the size and averaged down
  const int w = width * kSuper, h = height * kSuper;
  cv::Mat big(h, w, CV_8UC3, cv::Vec3b(30, 26, 24));
  if (!points.empty()) {
    // Middle of the cloud by medians, so that stray points do not move it.
    auto middle = [&](auto member) {
      std::vector<float> v;
      for (const auto& p : points) v.push_back(p.*member);
      std::nth_element(v.begin(), v.begin() + static_cast<std::ptrdiff_t>(v.size() / 2), v.end());
      return static_cast<double>(v[v.size() / 2]);
    };
    const double mx = middle(&CloudPoint::x), my = middle(&CloudPoint::y), mz = middle(&CloudPoint::z);
    // The eye moves up and to the left on a circle around the middle: rotate by yaw, then pitch.
    const double yaw = 0.40, pitch = 0.12, distance = 1.15 * mz;
    std::vector<cv::Vec3d> turned;
    for (const auto& p : points) {
      const double x = p.x - mx, y = p.y - my, z = p.z - mz;
      const double x1 = std::cos(yaw) * x + std::sin(yaw) * z, z1 = -std::sin(yaw) * x + std::cos(yaw) * z;
      const double y2 = std::cos(pitch) * y - std::sin(pitch) * z1, z2 = std::sin(pitch) * y + std::cos(pitch) * z1;
      turned.emplace_back(x1, y2, z2 + distance);
    }
    // Frame: the middle 98 % of the points, across and down, fill it but for a margin.
    std::vector<double> across, down;
    for (const auto& p : turned) {
      if (p[2] <= 1e-6) continue;
      across.push_back(p[0] / p[2]);
      down.push_back(p[1] / p[2]);
    }
    if (!across.empty()) {
      const auto quantile = [](std::vector<double>& v, double share) {
        const auto at = static_cast<std::ptrdiff_t>(share * static_cast<double>(v.size() - 1));
        std::nth_element(v.begin(), v.begin() + at, v.end());
        return v[static_cast<size_t>(at)];
      };
      const double left = quantile(across, 0.01), right = quantile(across, 0.99);
      const double top = quantile(down, 0.01), bottom = quantile(down, 0.99);
      const double focal = 0.92 * std::min(w / std::max(1e-9, right - left), h / std::max(1e-9, bottom - top));
      const double shift_x = w / 2.0 - focal * (left + right) / 2, shift_y = h / 2.0 - focal * (top + bottom) / 2;
      const int dot = std::max(1, static_cast<int>(std::lround(1.2 * std::sqrt(static_cast<double>(w) * h /
                                                                               static_cast<double>(points.size())))));
      std::vector<float> depth(static_cast<size_t>(w) * h, std::numeric_limits<float>::infinity());
      const double span = std::max(1e-9, std::log(range.zmax / range.zmin));
      for (size_t i = 0; i < points.size(); ++i) {
        const auto& p = turned[i];
        if (p[2] <= 1e-6) continue;
        const double share = 1 - std::log(points[i].z / range.zmin) / span;
        const cv::Vec3b tint = colour(table, share);
        cv::Vec3b shade;
        for (int c = 0; c < 3; ++c) {
          shade[c] = static_cast<uint8_t>(std::min(255.0, points[i].grey * (0.7 + 0.9 * tint[c] / 255.0)));
        }
        const int cx = static_cast<int>(std::lround(shift_x + focal * p[0] / p[2])) - dot / 2;
        const int cy = static_cast<int>(std::lround(shift_y + focal * p[1] / p[2])) - dot / 2;
        for (int y = std::max(0, cy); y < std::min(h, cy + dot); ++y) {
          for (int x = std::max(0, cx); x < std::min(w, cx + dot); ++x) {
            float& z = depth[static_cast<size_t>(y) * w + x];
            if (static_cast<float>(p[2]) >= z) continue;
            z = static_cast<float>(p[2]);
            big.at<cv::Vec3b>(y, x) = shade;
          }
        }
      }
    }
  }
  cv::Mat out;
  cv::resize(big, out, cv::Size(width, height), 0, 0, cv::INTER_AREA);
  return out;
}

}  // namespace psweep
