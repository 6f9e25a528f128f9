// SPDX-License-Identifier: Apache-2.0
#include "io/calibration.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <map>
#include <opencv2/calib3d.hpp>
#include <sstream>
#include <vector>

#include "core/error.hpp"
#include "io/text_file.hpp"

namespace psweep {
namespace {

constexpr int kMaxSide = 65535;

// Shortest text that reads back as the same double.
std::string number(double v) {
  char text[40];
  for (int digits = 15; digits <= 17; ++digits) {
    std::snprintf(text, sizeof text, "%.*g", digits, v);
    if (std::strtod(text, nullptr) == v) break;
  }
  return text;
}

// Short form, for messages.
std::string shown(double v) {
  char text[40];
  std::snprintf(text, sizeof text, "%g", v);
  return text;
}

// One calibration file as a tree of nodes, with the checks that all kinds share.
class Reader {
 public:
  explicit Reader(std::string file) : file_(std::move(file)) {}

  [[noreturn]] void fail(const std::string& field, const std::string& found, const std::string& expected) const {
    throw InputError(file_ + ": field '" + field + "': found " + found + ", expected " + expected);
  }

  void check(bool good, const std::string& field, double found, const std::string& expected) const {
    if (!good) fail(field, shown(found), expected);
  }

  double real(const cv::FileNode& node, const std::string& field, const std::string& expected = "a number") const {
    if (node.empty()) fail(field, "nothing", expected);
    if (node.isString()) fail(field, "'" + static_cast<std::string>(node) + "'", expected);
    if (!node.isInt() && !node.isReal()) fail(field, node.isMap() ? "a map" : "a list", expected);
    const double v = static_cast<double>(node);
    if (!std::isfinite(v)) fail(field, shown(v), expected);
    return v;
  }

  double positive(const cv::FileNode& node, const std::string& field) const {
    const double v = real(node, field, "a number > 0");
    check(v > 0, field, v, "a number > 0");
    return v;
  }

  int side(const cv::FileNode& node, const std::string& field) const {
    return side(real(node, field, "an integer 1 .. 65535"), field);
  }
  int side(double v, const std::string& field) const {
    check(v == std::floor(v) && v >= 1 && v <= kMaxSide, field, v, "an integer 1 .. 65535");
    return static_cast<int>(v);
  }

  // Matrix of rows x cols (rows or cols 0: any), as !!opencv-matrix or as (nested) list. Result CV_64F.
  cv::Mat matrix(const cv::FileNode& node, const std::string& field, int rows, int cols) const {
    const std::string expected = rows > 0 && cols > 0
                                     ? "a " + std::to_string(rows) + "x" + std::to_string(cols) + " matrix of numbers"
                                     : "a matrix of numbers";
    if (node.empty()) fail(field, "nothing", expected);
    cv::Mat m;
    if (node.isMap()) {
      try {
        node >> m;
      } catch (const cv::Exception&) {
        fail(field, "a matrix that OpenCV cannot read", expected);
      }
      if (m.channels() != 1) fail(field, std::to_string(m.channels()) + " channels", expected);
    } else if (node.isSeq()) {
      std::vector<double> values;
      int found_rows = 1;
      if (node.size() > 0 && (*node.begin()).isSeq()) {
        found_rows = static_cast<int>(node.size());
        for (const auto& row : node) {
          if (!row.isSeq() || row.size() != (*node.begin()).size()) fail(field, "rows of unequal length", expected);
          for (const auto& v : row) values.push_back(real(v, field, expected));
        }
      } else {
        for (const auto& v : node) values.push_back(real(v, field, expected));
      }
      if (!values.empty()) m = cv::Mat(values, true).reshape(1, found_rows);
    } else {
      fail(field, "a single value", expected);
    }
    if (m.empty()) fail(field, "an empty matrix", expected);
    m.convertTo(m, CV_64F);
    const bool vector = rows == 1 || cols == 1;  // either orientation, or a flat list
    if (rows > 0 && cols > 0 && static_cast<int>(m.total()) == rows * cols && (vector || m.rows == 1)) {
      m = m.reshape(1, rows);
    }
    if ((rows > 0 && m.rows != rows) || (cols > 0 && m.cols != cols)) {
      fail(field, std::to_string(m.rows) + "x" + std::to_string(m.cols), expected);
    }
    for (int y = 0; y < m.rows; ++y) {
      for (int x = 0; x < m.cols; ++x) {
        if (!std::isfinite(m.at<double>(y, x))) {
          fail(field + "[" + std::to_string(y) + "][" + std::to_string(x) + "]", shown(m.at<double>(y, x)), expected);
        }
      }
    }
    return m;
  }

  // An element that a matrix of this kind must have; relative to 1 or to the focal length, hence the tolerance.
  void element(const cv::Mat& m, const std::string& field, int y, int x, double expected) const {
    const double v = m.at<double>(y, x);
    const std::string name = field + "[" + std::to_string(y) + "][" + std::to_string(x) + "]";
    check(std::abs(v - expected) <= 1e-6 * std::max(1.0, std::abs(expected)), name, v, shown(expected));
  }

  const std::string& file() const { return file_; }

 private:
  std::string file_;
};

// Width and height, under this project's or OpenCV's usual names; both or none.
void read_size(const Reader& in, const cv::FileNode& root, Rig& rig) {
  const bool alternative = root["width"].empty() && root["height"].empty();
  const std::string w = alternative ? "image_width" : "width", h = alternative ? "image_height" : "height";
  if (root[w].empty() && root[h].empty()) return;
  rig.width = in.side(root[w], w);
  rig.height = in.side(root[h], h);
}

// Factor to metres of the lengths in an OpenCV file, which itself says nothing about units.
double read_unit(const Reader& in, const cv::FileNode& root) {
  const cv::FileNode node = root["unit"];
  if (node.empty()) return 1;
  const std::string name = node.isString() ? static_cast<std::string>(node) : "";
  if (name == "m") return 1;
  if (name == "cm") return 0.01;
  if (name == "mm") return 0.001;
  in.fail("unit", node.isString() ? "'" + name + "'" : "no text", "m, cm or mm");
}

void check_keys(const Reader& in, const cv::FileNode& map, const std::string& prefix,
                const std::vector<std::string>& known) {
  for (const auto& key : map.keys()) {
    if (std::find(known.begin(), known.end(), key) == known.end()) {
      std::string list;
      for (const auto& k : known) list += (list.empty() ? "" : ", ") + k;
      in.fail(prefix + key, "an unknown name", "one of " + list);
    }
  }
}

Camera read_camera(const Reader& in, const cv::FileNode& root, const std::string& name) {
  const cv::FileNode node = root[name];
  if (node.empty()) in.fail(name, "nothing", "a map with fx, fy, cx, cy");
  if (!node.isMap()) in.fail(name, "a single value or list", "a map with fx, fy, cx, cy");
  check_keys(in, node, name + ".", {"fx", "fy", "cx", "cy"});
  Camera c;
  c.fx = in.positive(node["fx"], name + ".fx");
  c.fy = in.positive(node["fy"], name + ".fy");
  c.cx = in.real(node["cx"], name + ".cx");
  c.cy = in.real(node["cy"], name + ".cy");
  return c;
}

Rig read_psweep(const Reader& in, const cv::FileNode& root) {
  check_keys(in, root, "", {"width", "height", "baseline", "row_offset", "left", "right"});
  Rig rig;
  rig.left = read_camera(in, root, "left");
  rig.right = read_camera(in, root, "right");
  rig.baseline = in.positive(root["baseline"], "baseline");
  if (!root["row_offset"].empty()) rig.right.cy += in.real(root["row_offset"], "row_offset");
  read_size(in, root, rig);
  return rig;
}

Camera projection_camera(const Reader& in, const cv::Mat& p, const std::string& name) {
  for (const auto& [y, x] : std::vector<std::pair<int, int>>{{0, 1}, {1, 0}, {1, 3}, {2, 0}, {2, 1}, {2, 3}}) {
    in.element(p, name, y, x, 0);
  }
  in.element(p, name, 2, 2, 1);
  in.check(p.at<double>(0, 0) > 0, name + "[0][0]", p.at<double>(0, 0), "a focal length > 0");
  in.check(p.at<double>(1, 1) > 0, name + "[1][1]", p.at<double>(1, 1), "a focal length > 0");
  return {p.at<double>(0, 0), p.at<double>(1, 1), p.at<double>(0, 2), p.at<double>(1, 2)};
}

Rig read_projection(const Reader& in, const cv::FileNode& root) {
  const cv::Mat p1 = in.matrix(root["P1"], "P1", 3, 4), p2 = in.matrix(root["P2"], "P2", 3, 4);
  Rig rig;
  rig.left = projection_camera(in, p1, "P1");
  if (p2.at<double>(0, 3) == 0 && p2.at<double>(1, 3) != 0) {
    in.fail("P2[1][3]", shown(p2.at<double>(1, 3)), "0: a vertical stereo pair is not supported");
  }
  rig.right = projection_camera(in, p2, "P2");
  in.element(p1, "P1", 0, 3, 0);
  const double shift = p2.at<double>(0, 3);  // fx * Tx, Tx < 0 where the second camera is on the right
  in.check(shift < 0, "P2[0][3]", shift, "a number < 0 (second camera on the right; else exchange the images)");
  rig.baseline = -shift / rig.right.fx * read_unit(in, root);
  read_size(in, root, rig);
  return rig;
}

Rig read_reprojection(const Reader& in, const cv::FileNode& root) {
  const cv::Mat q = in.matrix(root["Q"], "Q", 4, 4);
  for (const auto& [y, x] :
       std::vector<std::pair<int, int>>{{0, 1}, {0, 2}, {1, 0}, {1, 2}, {2, 0}, {2, 1}, {2, 2}, {3, 0}, {3, 1}}) {
    in.element(q, "Q", y, x, 0);
  }
  in.element(q, "Q", 0, 0, 1);
  in.element(q, "Q", 1, 1, 1);
  const double f = q.at<double>(2, 3), inverse = q.at<double>(3, 2);  // -1 / Tx
  in.check(f > 0, "Q[2][3]", f, "a focal length > 0");
  in.check(inverse > 0, "Q[3][2]", inverse, "a number > 0 (1 / baseline; else exchange the images)");
  Rig rig;
  rig.left = {f, f, -q.at<double>(0, 3), -q.at<double>(1, 3)};
  rig.right = rig.left;
  rig.right.cx = rig.left.cx + q.at<double>(3, 3) / inverse;  // Q[3][3] = (cx1 - cx2) / Tx
  rig.baseline = 1 / inverse * read_unit(in, root);
  read_size(in, root, rig);
  return rig;
}

// The first of several usual names that the file has, or the first.
std::string pick(const cv::FileNode& root, const std::vector<std::string>& names) {
  for (const auto& name : names) {
    if (!root[name].empty()) return name;
  }
  return names.front();
}

std::string name_of_k(const cv::FileNode& root, const std::string& index) {
  return pick(root, {"K" + index, "M" + index, "cameraMatrix" + index, "camera_matrix_" + index});
}
std::string name_of_d(const cv::FileNode& root, const std::string& index) {
  return pick(root, {"D" + index, "distCoeffs" + index, "distortion_coefficients_" + index});
}

RawCameras read_raw(const Reader& in, const cv::FileNode& root) {
  RawCameras raw;
  for (const std::string index : {"1", "2"}) {
    const std::string kn = name_of_k(root, index), dn = name_of_d(root, index);
    const cv::Mat k = in.matrix(root[kn], kn, 3, 3);
    in.check(k.at<double>(0, 0) > 0, kn + "[0][0]", k.at<double>(0, 0), "a focal length > 0");
    in.check(k.at<double>(1, 1) > 0, kn + "[1][1]", k.at<double>(1, 1), "a focal length > 0");
    for (const auto& [y, x] : std::vector<std::pair<int, int>>{{1, 0}, {2, 0}, {2, 1}}) in.element(k, kn, y, x, 0);
    in.element(k, kn, 2, 2, 1);
    cv::Mat d = in.matrix(root[dn], dn, 0, 0);
    const std::string counts = "4, 5, 8, 12 or 14 distortion coefficients";
    if (d.rows != 1 && d.cols != 1) in.fail(dn, std::to_string(d.rows) + "x" + std::to_string(d.cols), counts);
    d = d.reshape(1, 1);
    const int n = d.cols;
    if (n != 4 && n != 5 && n != 8 && n != 12 && n != 14) in.fail(dn, std::to_string(n) + " values", counts);
    (index == "1" ? raw.k1 : raw.k2) = k;
    (index == "1" ? raw.d1 : raw.d2) = d;
  }
  cv::Mat r = in.matrix(root["R"], "R", 0, 0);
  if (r.total() == 3) {
    cv::Mat full;
    cv::Rodrigues(r.reshape(1, 3), full);
    r = full;
  } else if (r.total() == 9 && r.rows == 1) {
    r = r.reshape(1, 3);
  }
  if (r.rows != 3 || r.cols != 3) {
    in.fail("R", std::to_string(r.rows) + "x" + std::to_string(r.cols), "a 3x3 rotation matrix or 3 Rodrigues values");
  }
  const double off = cv::norm(cv::Mat(r * r.t()), cv::Mat::eye(3, 3, CV_64F));
  if (off > 1e-3 || cv::determinant(r) < 0) in.fail("R", "a matrix that is no rotation", "R R^T = 1, det R = 1");
  raw.r = r;
  raw.t = in.matrix(root["T"], "T", 3, 1) * read_unit(in, root);
  const double tx = raw.t.at<double>(0), ty = raw.t.at<double>(1);
  if (std::abs(ty) > std::abs(tx)) in.fail("T", "a vertical baseline", "cameras side by side (|T[0]| > |T[1]|)");
  in.check(tx < 0, "T[0]", tx, "a number < 0 (second camera on the right; else exchange the images)");
  return raw;
}

// calib.txt: "name=value" lines; cam0 and cam1 are "[f 0 cx; 0 f cy; 0 0 1]".
Calibration read_middlebury(const Reader& in, const std::string& text) {
  std::map<std::string, std::string> values;
  std::istringstream lines(text);
  for (std::string line; std::getline(lines, line);) {
    while (!line.empty() && std::isspace(static_cast<unsigned char>(line.back()))) line.pop_back();
    const size_t eq = line.find('=');
    if (eq == std::string::npos) {
      if (!line.empty()) in.fail(line.substr(0, 40), "a line without '='", "name=value");
      continue;
    }
    if (!values.emplace(line.substr(0, eq), line.substr(eq + 1)).second) {
      in.fail(line.substr(0, eq), "the name twice", "one value");
    }
  }
  auto real = [&](const std::string& field, const std::string& expected) {
    const auto it = values.find(field);
    if (it == values.end()) in.fail(field, "nothing", expected);
    char* end = nullptr;
    const double v = std::strtod(it->second.c_str(), &end);
    if (it->second.empty() || *end || !std::isfinite(v)) in.fail(field, "'" + it->second + "'", expected);
    return v;
  };
  auto camera = [&](const std::string& field) {
    const std::string expected = "[f 0 cx; 0 f cy; 0 0 1]";
    const auto it = values.find(field);
    if (it == values.end()) in.fail(field, "nothing", expected);
    std::string body = it->second;
    for (char& c : body) {
      if (c == '[' || c == ']' || c == ';' || c == ',') c = ' ';
    }
    std::istringstream words(body);
    std::vector<double> m;
    for (double v; words >> v;) m.push_back(v);
    const bool shape = m.size() == 9 && words.eof() && m[1] == 0 && m[3] == 0 && m[6] == 0 && m[7] == 0 && m[8] == 1 &&
                       m[0] > 0 && m[4] > 0;
    if (!shape) in.fail(field, "'" + it->second + "'", expected);
    return Camera{m[0], m[4], m[2], m[5]};
  };
  Calibration out;
  out.kind = CalibrationKind::kMiddlebury;
  out.rig.left = camera("cam0");
  out.rig.right = camera("cam1");
  const double baseline = real("baseline", "millimetres > 0");
  in.check(baseline > 0, "baseline", baseline, "millimetres > 0");
  out.rig.baseline = baseline / 1000;
  out.rig.width = in.side(real("width", "an integer 1 .. 65535"), "width");
  out.rig.height = in.side(real("height", "an integer 1 .. 65535"), "height");
  const double apart = out.rig.right.cx - out.rig.left.cx;
  const double doffs = values.count("doffs") ? real("doffs", "pixels") : apart;
  in.check(std::abs(doffs - apart) < 0.01, "doffs", doffs, shown(apart) + " = cx of cam1 - cx of cam0");
  if (values.count("ndisp")) {
    const double ndisp = real("ndisp", "pixels > 0");
    in.check(ndisp > 0, "ndisp", ndisp, "pixels > 0");
    double lo = values.count("vmin") ? real("vmin", "pixels") : 0;
    const double hi = ndisp + doffs;
    in.check(hi > 0, "ndisp", ndisp, "ndisp + doffs > 0");
    // Infinity cannot be a plane: a tenth of the range is where disparities of a few pixels end anyway.
    lo = std::max(lo + doffs, hi / 10);
    if (lo < hi) out.search = DisparityRange{lo, hi};
  }
  return out;
}

}  // namespace

const char* to_string(CalibrationKind kind) {
  switch (kind) {
    case CalibrationKind::kPsweep:
      return "psweep YAML";
    case CalibrationKind::kProjection:
      return "OpenCV P1/P2";
    case CalibrationKind::kReprojection:
      return "OpenCV Q";
    case CalibrationKind::kMiddlebury:
      return "Middlebury calib.txt";
    case CalibrationKind::kRaw:
      return "OpenCV K, D, R, T (rectified by psweep)";
    case CalibrationKind::kDisparityRange:
      return "disparity range (depths are relative)";
  }
  return "";
}

Calibration read_calibration(const std::filesystem::path& path, Rectify rectify) {
  const std::string text = read_file(path);
  const Reader in(path.string());
  Calibration out;
  if (text.compare(0, 5, "cam0=") == 0 || text.find("\ncam0=") != std::string::npos) {
    out = read_middlebury(in, text);
    out.source = path.string();
    return out;
  }
  const size_t first = text.find_first_not_of(" \t\r\n");
  if (first == std::string::npos) throw InputError(in.file() + ": the file is empty, expected a calibration");
  if (text.find('\0') != std::string::npos) {
    throw InputError(in.file() + ": not a text file, expected a calibration (YAML, XML, JSON or calib.txt)");
  }
  // FileStorage insists on its first line and on a last line feed.
  const bool marked = text[first] == '{' || text[first] == '<' || text.compare(first, 5, "%YAML") == 0;
  cv::FileStorage storage;
  try {
    storage.open((marked ? "" : "%YAML:1.0\n---\n") + text.substr(first) + "\n",
                 cv::FileStorage::READ | cv::FileStorage::MEMORY);
  } catch (const cv::Exception& e) {
    throw InputError(in.file() +
                     ": not a calibration: neither Middlebury calib.txt nor YAML, XML or JSON as OpenCV's " +
                     "FileStorage reads it: " + e.err);
  }
  const cv::FileNode root = storage.isOpened() ? storage.root() : cv::FileNode();
  if (!root.isMap()) throw InputError(in.file() + ": not a calibration: found no names with values");
  auto has = [&](const std::string& name) { return !root[name].empty(); };
  const bool rectified = has("P1") || has("P2") || has("Q");
  const bool raw = has(name_of_k(root, "1")) || has(name_of_k(root, "2")) || has(name_of_d(root, "1")) ||
                   (!rectified && has("R") && has("T"));
  if (has("left") || has("right")) {
    out.kind = CalibrationKind::kPsweep;
    out.rig = read_psweep(in, root);
  } else if (raw && rectified && rectify == Rectify::kAuto) {
    throw InputError(in.file() +
                     ": fields 'K1' and 'P1' (or 'Q'): found both, so the images may be raw or rectified; " +
                     "say --rectify yes or --rectify no");
  } else if (raw && rectify != Rectify::kNo) {
    out.kind = CalibrationKind::kRaw;
    out.raw = read_raw(in, root);
    read_size(in, root, out.rig);
  } else if (has("P1") || has("P2")) {
    out.kind = CalibrationKind::kProjection;
    out.rig = read_projection(in, root);
  } else if (has("Q")) {
    out.kind = CalibrationKind::kReprojection;
    out.rig = read_reprojection(in, root);
  } else {
    std::string keys;
    for (const auto& key : root.keys()) keys += (keys.empty() ? "" : ", ") + key;
    throw InputError(in.file() + ": not a calibration: found " + (keys.empty() ? "no names" : "the names " + keys) +
                     ", expected left/right, P1/P2, Q, K1 D1 K2 D2 R T, or cam0= of Middlebury");
  }
  out.source = path.string();
  return out;
}

std::string calibration_yaml(const Rig& rig) {
  auto camera = [](const Camera& c) {
    return "{ fx: " + number(c.fx) + ", fy: " + number(c.fy) + ", cx: " + number(c.cx) + ", cy: " + number(c.cy) +
           " }\n";
  };
  return "%YAML:1.0\n---\n# psweep calibration of a rectified pair: pixels and metres, see "
         "docs/file_formats.md\nwidth: " +
         std::to_string(rig.width) + "\nheight: " + std::to_string(rig.height) + "\nbaseline: " + number(rig.baseline) +
         "\nleft: " + camera(rig.left) + "right: " + camera(rig.right);
}

void write_calibration(const std::filesystem::path& path, const Rig& rig) { write_file(path, calibration_yaml(rig)); }

Calibration disparity_range_calibration(double lo, double hi, int width, int height) {
  Calibration out;
  out.kind = CalibrationKind::kDisparityRange;
  out.source = "--disparity-range";
  out.metric = false;
  const double f = width;
  out.rig.left = out.rig.right = {f, f, (width - 1) / 2.0, (height - 1) / 2.0};
  out.rig.baseline = 0.1;
  out.rig.width = width;
  out.rig.height = height;
  out.search = DisparityRange{lo, hi};
  return out;
}

PlaneSpacing planes_for(const Rig& rig, const DisparityRange& range, double step) {
  const double fb = rig.cyclopean().fx * rig.baseline;
  PlaneSpacing out;
  out.zmin = fb / range.hi;
  out.zmax = fb / range.lo;
  // The nearest two planes are furthest apart in disparity: hi (1 - r), r = (lo/hi)^(1/(planes-1)).
  const double ratio = std::max(0.5, 1 - step / range.hi);
  out.planes = std::clamp(1 + static_cast<int>(std::ceil(std::log(range.lo / range.hi) / std::log(ratio))), 3, 1024);
  return out;
}

void adopt_size(Calibration& calibration, const std::string& image_name, int width, int height) {
  Rig& rig = calibration.rig;
  if (rig.width == 0) {
    rig.width = width;
    rig.height = height;
  }
  if (rig.width != width || rig.height != height) {
    throw InputError(image_name + ": the image is " + std::to_string(width) + "x" + std::to_string(height) + ", but " +
                     calibration.source + " (fields 'width', 'height') says " + std::to_string(rig.width) + "x" +
                     std::to_string(rig.height));
  }
}

}  // namespace psweep
