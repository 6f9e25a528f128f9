// SPDX-License-Identifier: Apache-2.0
// Files in and out: formats against bytes written by hand here, calibrations of every kind against their formulas,
// and every kind of bad file against the message that names file and field.
#include <cmath>
#include <cstring>
#include <filesystem>
#include <limits>
#include <opencv2/calib3d.hpp>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "core/error.hpp"
#include "io/calibration.hpp"
#include "io/image_io.hpp"
#include "io/output_dir.hpp"
#include "io/pfm.hpp"
#include "io/picture.hpp"
#include "io/ply.hpp"
#include "io/progress.hpp"
#include "io/rectify.hpp"
#include "io/reprojection.hpp"
#include "io/text_file.hpp"
#include "support/catch.hpp"
#include "support/temporary_dir.hpp"

using namespace psweep;
namespace fs = std::filesystem;
#ifdef PSWEEP_CATCH2_V3
using Catch::Approx;  // version 2 has it in the global namespace
#endif

namespace {

const float kInf = std::numeric_limits<float>::infinity();

// Message of the InputError that `call` throws; empty if it throws none.
template <class Call>
std::string message_of(Call&& call) {
  try {
    call();
  } catch (const InputError& e) {
    return e.what();
  }
  return "";
}

fs::path put(const TemporaryDir& dir, const std::string& name, const std::string& text) {
  write_file(dir / name, text);
  return dir / name;
}

const char* const kYaml =
    "%YAML:1.0\n---\nwidth: 640\nheight: 480\nbaseline: 0.2\nrow_offset: 1.5\n"
    "left: { fx: 500., fy: 501., cx: 319.5, cy: 239.5 }\nright: { fx: 502., fy: 503., cx: 320.5, cy: 240.5 }\n";

std::string replaced(std::string text, const std::string& from, const std::string& to) {
  const size_t at = text.find(from);
  REQUIRE(at != std::string::npos);
  return text.replace(at, from.size(), to);
}

}  // namespace

TEST_CASE("PFM bytes are those of the format", "[io][pfm]") {
  const TemporaryDir dir;
  FloatImage image(2, 2);
  image.at(0, 0) = 1.0f;   // 3f800000
  image.at(1, 0) = kInf;   // 7f800000
  image.at(0, 1) = -2.0f;  // c0000000
  image.at(1, 1) = 0.5f;   // 3f000000
  write_pfm(dir / "a.pfm", image);
  const std::string expected = std::string("Pf\n2 2\n-1.0\n") +
                               std::string("\x00\x00\x00\xc0\x00\x00\x00\x3f", 8) +  // bottom row first
                               std::string("\x00\x00\x80\x3f\x00\x00\x80\x7f", 8);
  CHECK(read_file(dir / "a.pfm") == expected);
  CHECK(read_pfm(dir / "a.pfm").data == image.data);

  const std::string big = std::string("Pf\n2 1\n1\n") + std::string("\x3f\x80\x00\x00\x7f\x80\x00\x00", 8);
  const FloatImage read = read_pfm(put(dir, "big.pfm", big));
  CHECK(read.data == std::vector<float>{1.0f, kInf});
  CHECK(read.width == 2);
}

TEST_CASE("PFM agrees with OpenCV's reader", "[io][pfm]") {
  const TemporaryDir dir;
  FloatImage image(5, 3);
  for (size_t i = 0; i < image.data.size(); ++i) image.data[i] = 0.1f * static_cast<float>(i) - 0.4f;
  write_pfm(dir / "a.pfm", image);
  const cv::Mat other = cv::imread((dir / "a.pfm").string(), cv::IMREAD_UNCHANGED);
  REQUIRE(other.type() == CV_32FC1);
  REQUIRE(other.size() == cv::Size(5, 3));
  for (int y = 0; y < 3; ++y) {
    for (int x = 0; x < 5; ++x) CHECK(other.at<float>(y, x) == image.at(x, y));
  }
}

TEST_CASE("bad PFM files are refused by field", "[io][pfm][error]") {
  const TemporaryDir dir;
  struct Case {
    std::string bytes, field;
  };
  const Case c = GENERATE(
      Case{"", "'magic'"}, Case{"PF\n2 2\n-1\n", "'magic'"}, Case{"P5\n2 2\n255\nabcd", "'magic'"},
      Case{"Pf\nx 2\n-1\n", "'width'"}, Case{"Pf\n0 2\n-1\n", "'width'"}, Case{"Pf\n2 70000\n-1\n", "'height'"},
      Case{"Pf\n2 -3\n-1\n", "'height'"}, Case{"Pf\n2 2\n0\n", "'scale'"}, Case{"Pf\n2 2\nnan\n", "'scale'"},
      Case{"Pf\n2 2\n", "'scale'"}, Case{"Pf\n2 2\n-1\nabc", "'pixels'"}, Case{"Pf\n1 1\n-1\nabcdefgh", "'pixels'"});
  const fs::path file = put(dir, "bad.pfm", c.bytes);
  const std::string message = message_of([&] { read_pfm(file); });
  INFO(message);
  CHECK_THAT(message, contains(file.string() + ": field " + c.field));
}

TEST_CASE("PLY bytes are those of the format", "[io][ply]") {
  const TemporaryDir dir;
  const std::vector<CloudPoint> points = {{1.0f, -2.0f, 0.5f, 200, 1.0f}, {0.0f, 0.0f, 2.0f, 7, 0.5f}};
  write_ply(dir / "a.ply", points);
  const std::string bytes = read_file(dir / "a.ply");
  CHECK(bytes.compare(0, 40, "ply\nformat binary_little_endian 1.0\ncomm", 40) == 0);
  CHECK_THAT(bytes, contains("\nelement vertex 2\nproperty float x\n"));
  const std::string first("\x00\x00\x80\x3f\x00\x00\x00\xc0\x00\x00\x00\x3f\xc8\xc8\xc8\x00\x00\x80\x3f", 19);
  const std::string end = "end_header\n";
  const size_t data = bytes.find(end) + end.size();
  CHECK(bytes.substr(data, 19) == first);
  CHECK(bytes.size() == data + 2 * 19);
  const auto read = read_ply(dir / "a.ply");
  REQUIRE(read.size() == 2);
  CHECK(read[1].z == 2.0f);
  CHECK(read[1].grey == 7);
  CHECK(read[1].confidence == 0.5f);

  const fs::path cut = put(dir, "cut.ply", bytes.substr(0, bytes.size() - 1));
  CHECK_THAT(message_of([&] { read_ply(cut); }), contains("cut.ply: field 'element vertex'"));
  const fs::path other = put(dir, "other.ply", "ply\nformat ascii 1.0\n");
  CHECK_THAT(message_of([&] { read_ply(other); }), contains("other.ply: field 'header'"));
}

TEST_CASE("images of all accepted kinds become the same grey", "[io][image]") {
  const TemporaryDir dir;
  cv::Mat grey(7, 9, CV_8UC1), colour, alpha;
  for (int i = 0; i < 63; ++i) grey.data[i] = static_cast<uint8_t>(i * 4);
  cv::cvtColor(grey, colour, cv::COLOR_GRAY2BGR);
  cv::cvtColor(grey, alpha, cv::COLOR_GRAY2BGRA);
  for (int i = 0; i < 63; ++i) alpha.data[4 * i + 3] = static_cast<uint8_t>(i);  // must not matter
  const std::string name = GENERATE(as<std::string>{}, "g.png", "g.pgm", "g.tiff", "c.png", "c.ppm", "c.tiff", "a.png");
  const cv::Mat& source = name[0] == 'g' ? grey : name[0] == 'c' ? colour : alpha;
  REQUIRE(cv::imwrite((dir / name).string(), source));
  const Gray read = read_gray(dir / name);
  REQUIRE(read.width == 9);
  REQUIRE(read.height == 7);
  CHECK(std::memcmp(read.data.data(), grey.data, 63) == 0);
}

TEST_CASE("colour is weighted as documented", "[io][image]") {
  const TemporaryDir dir;
  REQUIRE(cv::imwrite((dir / "c.png").string(), cv::Mat(1, 1, CV_8UC3, cv::Scalar(50, 100, 200))));
  CHECK(std::abs(read_gray(dir / "c.png").at(0, 0) - (0.114 * 50 + 0.587 * 100 + 0.299 * 200)) < 1);
}

TEST_CASE("bad images are refused by name", "[io][image][error]") {
  const TemporaryDir dir;
  silence_opencv();
  cv::Mat grey(64, 64, CV_8UC1);
  cv::randu(grey, 0, 256);
  cv::Mat deep(8, 8, CV_16UC1, cv::Scalar(1000));
  for (const char* name : {"deep.png", "deep.tiff", "deep.pgm"}) {
    REQUIRE(cv::imwrite((dir / name).string(), deep));
    CHECK_THAT(message_of([&] { read_gray(dir / name); }), contains(std::string(name) + ": 16-bit image"));
  }
  REQUIRE(cv::imwrite((dir / "float.tiff").string(), cv::Mat(8, 8, CV_32FC1, cv::Scalar(1))));
  CHECK_THAT(message_of([&] { read_gray(dir / "float.tiff"); }), contains("float.tiff: floating-point image"));
  for (const char* name : {"cut.png", "cut.pgm", "cut.tiff"}) {
    REQUIRE(cv::imwrite((dir / name).string(), grey));
    const std::string bytes = read_file(dir / name);
    for (const size_t keep : {bytes.size() / 2, bytes.size() - bytes.size() / 10, size_t{10}}) {
      put(dir, name, bytes.substr(0, keep));
      INFO(name << " cut to " << keep << " of " << bytes.size());
      CHECK_THAT(message_of([&] { read_gray(dir / name); }), contains(std::string(name) + ": not an image, truncated"));
    }
  }
  REQUIRE(cv::imwrite((dir / "end.png").string(), grey));
  const std::string whole = read_file(dir / "end.png");
  put(dir, "end.png", whole.substr(0, whole.size() - 12));
  CHECK_THAT(message_of([&] { read_gray(dir / "end.png"); }), contains("end.png: not an image, truncated"));
  CHECK_THAT(message_of([&] { read_gray(put(dir, "text.png", "hello")); }), contains("text.png: not an image"));
  CHECK_THAT(message_of([&] { read_gray(put(dir, "empty.png", "")); }), contains("empty.png: the file is empty"));
  CHECK_THAT(message_of([&] { read_gray(dir / "none.png"); }), contains("none.png: cannot read: No such file"));
  CHECK_THAT(message_of([&] { read_gray(dir.path()); }), contains("is a directory"));
}

TEST_CASE("psweep YAML: read, and written back to the same rig", "[io][calibration]") {
  const TemporaryDir dir;
  // With and without the line that OpenCV insists on.
  const std::string text = GENERATE(std::string(kYaml), std::string(kYaml).substr(14));
  const Calibration c = read_calibration(put(dir, "c.yaml", text));
  CHECK(c.kind == CalibrationKind::kPsweep);
  CHECK(c.rig.width == 640);
  CHECK(c.rig.height == 480);
  CHECK(c.rig.baseline == 0.2);
  CHECK(c.rig.left.fx == 500);
  CHECK(c.rig.left.fy == 501);
  CHECK(c.rig.right.cx == 320.5);
  CHECK(c.rig.right.cy == 242.0);  // with the row offset

  Rig odd = c.rig;
  odd.left.fx = 1.0 / 3;
  odd.baseline = 0.1;
  odd.right.cy = std::sqrt(2.0);
  write_calibration(dir / "back.yaml", odd);
  const Rig back = read_calibration(dir / "back.yaml").rig;
  CHECK(back.left.fx == odd.left.fx);
  CHECK(back.baseline == odd.baseline);
  CHECK(back.right.cy == odd.right.cy);
  CHECK(back.width == 640);
}

TEST_CASE("bad psweep YAML is refused by field", "[io][calibration][error]") {
  const TemporaryDir dir;
  silence_opencv();
  struct Case {
    std::string from, to, message;
  };
  const Case c = GENERATE(
      Case{"fx: 500.", "fx: abc", "field 'left.fx': found 'abc', expected a number > 0"},
      Case{"fx: 500.", "fx: -5.", "field 'left.fx': found -5, expected a number > 0"},
      Case{"fx: 500.", "fx: .Nan", "field 'left.fx': found"}, Case{"fx: 500., ", "", "field 'left.fx': found nothing"},
      Case{"fx: 500.", "fx: [1, 2]", "field 'left.fx': found a list"},
      Case{"cy: 240.5", "cyy: 240.5", "field 'right.cyy': found an unknown name, expected one of fx, fy, cx, cy"},
      Case{"baseline: 0.2", "baseline: 0", "field 'baseline': found 0, expected a number > 0"},
      Case{"baseline: 0.2\n", "", "field 'baseline': found nothing"},
      Case{"baseline", "base_line", "field 'base_line': found an unknown name"},
      Case{"width: 640\n", "", "field 'width': found nothing"},
      Case{"width: 640", "width: 640.5", "field 'width': found 640.5, expected an integer 1 .. 65535"},
      Case{"height: 480", "height: 0", "field 'height': found 0"},
      Case{"row_offset: 1.5", "row_offset: down", "field 'row_offset': found 'down'"},
      Case{"right: { fx: 502., fy: 503., cx: 320.5, cy: 240.5 }\n", "", "field 'right': found nothing"},
      Case{"{ fx: 500., fy: 501., cx: 319.5, cy: 239.5 }", "7", "field 'left': found a single value"},
      Case{"width: 640", "width 640", "not a calibration"});
  const fs::path file = put(dir, "bad.yaml", replaced(kYaml, c.from, c.to));
  const std::string message = message_of([&] { read_calibration(file); });
  INFO(message);
  CHECK_THAT(message, contains(file.string() + ": " + c.message));
}

TEST_CASE("files that are no calibration at all", "[io][calibration][error]") {
  const TemporaryDir dir;
  silence_opencv();
  CHECK_THAT(message_of([&] { read_calibration(put(dir, "e.yaml", " \n")); }), contains("e.yaml: the file is empty"));
  CHECK_THAT(message_of([&] { read_calibration(put(dir, "o.yaml", "%YAML:1.0\n---\nname: x\n")); }),
             contains("o.yaml: not a calibration: found the names name, expected left/right"));
  CHECK_THAT(message_of([&] { read_calibration(put(dir, "b.yaml", std::string("\x89PNG\0\1", 6))); }),
             contains("b.yaml: not a text file"));
  CHECK_THAT(message_of([&] { read_calibration(dir / "none.yaml"); }), contains("none.yaml: cannot read"));
  for (const char* text : {"just words", "a: [1, 2", "{ \"a\": ", "<?xml version=\"1.0\"?><a>", "- 1\n- 2\n"}) {
    INFO(text);
    CHECK_THAT(message_of([&] { read_calibration(put(dir, "w.yaml", text)); }), contains("w.yaml: not a calibration"));
  }
}

// Cameras as OpenCV's own calibration sample would give them: distorted, converging, unequal.
namespace {
struct Stereo {
  cv::Mat k1 = (cv::Mat_<double>(3, 3) << 520, 0, 318, 0, 521, 242, 0, 0, 1);
  cv::Mat k2 = (cv::Mat_<double>(3, 3) << 525, 0, 322, 0, 524, 238, 0, 0, 1);
  cv::Mat d1 = (cv::Mat_<double>(1, 5) << -0.1, 0.02, 0.0005, -0.0003, 0);
  cv::Mat d2 = (cv::Mat_<double>(1, 5) << -0.3, 0.08, -0.0004, 0.0002, 0);
  cv::Mat r, t = (cv::Mat_<double>(3, 1) << -0.12, 0.002, 0.001);
  cv::Mat r1, r2, p1, p2, q;
  explicit Stereo(int flags) {
    cv::Rodrigues(cv::Mat(cv::Vec3d(0.01, -0.03, 0.005)), r);
    cv::stereoRectify(k1, d1, k2, d2, cv::Size(640, 480), r, t, r1, r2, p1, p2, q, flags, 0);
  }
};
}  // namespace

TEST_CASE("P1/P2 and Q of stereoRectify give the same rig", "[io][calibration]") {
  const TemporaryDir dir;
  const Stereo s(GENERATE(0, static_cast<int>(cv::CALIB_ZERO_DISPARITY)));  // 0: different cx left and right
  const std::string extension = GENERATE(as<std::string>{}, "yml", "xml", "json");
  {
    cv::FileStorage p((dir / ("p." + extension)).string(), cv::FileStorage::WRITE);
    p << "R1" << s.r1 << "R2" << s.r2 << "P1" << s.p1 << "P2" << s.p2 << "R" << s.r << "T" << s.t;
    cv::FileStorage q((dir / ("q." + extension)).string(), cv::FileStorage::WRITE);
    q << "Q" << s.q << "image_width" << 640 << "image_height" << 480;
  }
  const Calibration p = read_calibration(dir / ("p." + extension)), q = read_calibration(dir / ("q." + extension));
  CHECK(p.kind == CalibrationKind::kProjection);
  CHECK(q.kind == CalibrationKind::kReprojection);
  CHECK(p.rig.width == 0);
  CHECK(q.rig.width == 640);
  CHECK(p.rig.baseline == Approx(cv::norm(s.t)));
  for (const Rig* rig : {&p.rig, &q.rig}) {
    CHECK(rig->left.fx == Approx(s.p1.at<double>(0, 0)));
    CHECK(rig->left.cx == Approx(s.p1.at<double>(0, 2)));
    CHECK(rig->right.cx == Approx(s.p2.at<double>(0, 2)));
    CHECK(rig->left.cy == Approx(s.p1.at<double>(1, 2)));
    CHECK(rig->baseline == Approx(p.rig.baseline));
  }
  // The rig's projection is the matrices' projection.
  const cv::Mat point = (cv::Mat_<double>(4, 1) << 0.3, -0.2, 2.5, 1);  // from the left camera
  const cv::Mat l = s.p1 * point, r = s.p2 * point;
  const double half = p.rig.baseline / 2, x = 0.3 - half;  // from the cyclopean eye
  CHECK(p.rig.left.fx * (x + half) / 2.5 + p.rig.left.cx == Approx(l.at<double>(0) / l.at<double>(2)));
  CHECK(p.rig.right.fx * (x - half) / 2.5 + p.rig.right.cx == Approx(r.at<double>(0) / r.at<double>(2)));
}

TEST_CASE("units of OpenCV files", "[io][calibration]") {
  const TemporaryDir dir;
  const std::string q = "Q: [[1,0,0,-100],[0,1,0,-90],[0,0,0,500],[0,0,0.005,0]]\n";
  CHECK(read_calibration(put(dir, "a.yaml", q)).rig.baseline == Approx(200));
  CHECK(read_calibration(put(dir, "a.yaml", q + "unit: mm\n")).rig.baseline == Approx(0.2));
  CHECK(read_calibration(put(dir, "a.yaml", q + "unit: cm\n")).rig.baseline == Approx(2));
  CHECK_THAT(message_of([&] { read_calibration(put(dir, "a.yaml", q + "unit: inch\n")); }),
             contains("a.yaml: field 'unit': found 'inch', expected m, cm or mm"));
}

TEST_CASE("bad OpenCV matrices are refused by field and element", "[io][calibration][error]") {
  const TemporaryDir dir;
  silence_opencv();
  struct Case {
    std::string text, message;
  };
  const std::string p1 = "P1: [500,0,100,0, 0,500,90,0, 0,0,1,0]\n", p2 = "P2: [500,0,100,-50, 0,500,90,0, 0,0,1,0]\n";
  const std::string k =
      "K1: [500,0,100,0,500,90,0,0,1]\nK2: [500,0,100,0,500,90,0,0,1]\nD1: [0,0,0,0]\nD2: [0,0,0,0]\n";
  const std::string r = "R: [1,0,0,0,1,0,0,0,1]\n", t = "T: [-0.1,0,0]\n";
  const Case c = GENERATE_COPY(
      Case{p1, "field 'P2': found nothing, expected a 3x4 matrix"}, Case{p2, "field 'P1': found nothing"},
      Case{p1 + "P2: [1,2,3]\n", "field 'P2': found 1x3, expected a 3x4 matrix"},
      Case{p1 + "P2: 3\n", "field 'P2': found a single value"},
      Case{p1 + "P2: [[1,2],[3]]\n", "field 'P2': found rows of unequal length"},
      Case{p1 + replaced(p2, "-50", "50"), "field 'P2[0][3]': found 50, expected a number < 0"},
      Case{p1 + replaced(p2, "-50, 0,500,90,0", "0, 0,500,90,-50"),
           "field 'P2[1][3]': found -50, expected 0: a vertical"},
      Case{replaced(p1, "0,0,1,0", "0,0,2,0") + p2, "field 'P1[2][2]': found 2, expected 1"},
      Case{replaced(p1, "500,0,100", "-500,0,100") + p2, "field 'P1[0][0]': found -500"},
      Case{"Q: [[1,0,0,-1],[0,1,0,-1],[0,0,0,0],[0,0,5,0]]\n", "field 'Q[2][3]': found 0, expected a focal length"},
      Case{"Q: [[1,0,0,-1],[0,1,0,-1],[0,0,0,9],[0,0,-5,0]]\n", "field 'Q[3][2]': found -5"},
      Case{"Q: [[1,0,0,-1],[0,1,0,-1],[0,0,0,9]]\n", "field 'Q': found 3x4, expected a 4x4 matrix"},
      Case{k + r, "field 'T': found nothing"}, Case{k + t, "field 'R': found nothing"},
      Case{replaced(k, "D2: [0,0,0,0]\n", "") + r + t, "field 'D2': found nothing"},
      Case{replaced(k, "D2: [0,0,0,0]", "D2: [0,0,0]") + r + t,
           "field 'D2': found 3 values, expected 4, 5, 8, 12 or 14"},
      Case{replaced(k, "K2: [500", "K2: [0") + r + t, "field 'K2[0][0]': found 0"},
      Case{replaced(k, "K1: [500,0,100,0,500,90,0,0,1]", "K1: [1,2]") + r + t, "field 'K1': found 1x2"},
      Case{k + "R: [1,0,0,0,1,0,0,0,2]\n" + t, "field 'R': found a matrix that is no rotation"},
      Case{k + "R: [1,2]\n" + t, "field 'R': found 1x2"}, Case{k + r + "T: [0.1,0,0]\n", "field 'T[0]': found 0.1"},
      Case{k + r + "T: [0,-0.1,0]\n", "field 'T': found a vertical baseline"},
      Case{k + r + t + p1 + p2, "fields 'K1' and 'P1' (or 'Q'): found both"});
  const fs::path file = put(dir, "bad.yaml", c.text);
  const std::string message = message_of([&] { read_calibration(file); });
  INFO(message);
  CHECK_THAT(message, contains(file.string() + ": " + c.message));
}

TEST_CASE("Middlebury calib.txt", "[io][calibration]") {
  const TemporaryDir dir;
  const std::string text =
      "cam0=[3997.684 0 1176.728; 0 3997.684 1011.728; 0 0 1]\ncam1=[3997.684 0 1307.839; 0 3997.684 1011.728; 0 0 1]\n"
      "doffs=131.111\nbaseline=193.001\nwidth=2964\nheight=1988\nndisp=280\nisint=0\nvmin=31\nvmax=257\n";
  // Also with the line ends of another system.
  std::string dos = text;
  for (size_t at = 0; (at = dos.find('\n', at)) != std::string::npos; at += 2) dos.replace(at, 1, "\r\n");
  const Calibration c = read_calibration(put(dir, "calib.txt", GENERATE_COPY(text, dos)));
  CHECK(c.kind == CalibrationKind::kMiddlebury);
  CHECK(c.rig.baseline == Approx(0.193001));
  CHECK(c.rig.width == 2964);
  // Z = baseline * f / (d + doffs), from the data set's description.
  const double d = 100, z = 0.193001 * 3997.684 / (d + 131.111);
  const double half = c.rig.baseline / 2;
  const double xl = c.rig.left.fx * half / z + c.rig.left.cx, xr = -c.rig.right.fx * half / z + c.rig.right.cx;
  CHECK(xl - xr == Approx(d));
  REQUIRE(c.search);
  CHECK(c.search->hi == Approx(280 + 131.111));
  CHECK(c.search->lo == Approx(31 + 131.111));
  const PlaneSpacing planes = planes_for(c.rig, *c.search);
  CHECK(planes.zmin == Approx(0.193001 * 3997.684 / (280 + 131.111)));
  CHECK(planes.zmax == Approx(0.193001 * 3997.684 / (31 + 131.111)));
  const double fb = c.rig.left.fx * c.rig.baseline;
  CHECK(fb / planes.depth(0) - fb / planes.depth(1) <= 0.75);

  struct Case {
    std::string from, to, message;
  };
  for (const Case& bad :
       std::vector<Case>{{"baseline=193.001\n", "", "field 'baseline': found nothing"},
                         {"193.001", "abc", "field 'baseline': found 'abc'"},
                         {"193.001", "-3", "field 'baseline': found -3"},
                         {"width=2964", "width=0", "field 'width': found 0"},
                         {"height=1988", "height=19.5", "field 'height': found 19.5"},
                         {"doffs=131.111", "doffs=3", "field 'doffs': found 3, expected 131.111"},
                         {"ndisp=280", "ndisp=0", "field 'ndisp': found 0"},
                         {"cam1=[3997.684 0", "cam1=[3997.684", "field 'cam1': found '[3997.684 1307"},
                         {"cam1=", "cam2=", "field 'cam1': found nothing"},
                         {"isint=0", "isint", "field 'isint': found a line without '='"},
                         {"isint=0", "width=3", "field 'width': found the name twice"}}) {
    const fs::path file = put(dir, "bad.txt", replaced(text, bad.from, bad.to));
    const std::string message = message_of([&] { read_calibration(file); });
    INFO(message);
    CHECK_THAT(message, contains(file.string() + ": " + bad.message));
  }
}

TEST_CASE("raw cameras: rectified rows agree, and the rig measures the right depth", "[io][calibration][rectify]") {
  const TemporaryDir dir;
  const Stereo s(cv::CALIB_ZERO_DISPARITY);
  const auto names =
      GENERATE(std::vector<std::string>{"K1", "D1", "K2", "D2"}, std::vector<std::string>{"M1", "D1", "M2", "D2"},
               std::vector<std::string>{"cameraMatrix1", "distCoeffs1", "cameraMatrix2", "distCoeffs2"});
  {
    cv::FileStorage f((dir / "raw.yml").string(), cv::FileStorage::WRITE);
    f << names[0] << s.k1 << names[1] << s.d1 << names[2] << s.k2 << names[3] << s.d2 << "R" << s.r << "T" << s.t;
  }
  const Calibration c = read_calibration(dir / "raw.yml");
  REQUIRE(c.kind == CalibrationKind::kRaw);
  // A wall of dots at known places: each dot is drawn in the raw images where the distorted cameras see it.
  const double z = 2.0;
  cv::Mat raw[2] = {cv::Mat(480, 640, CV_8UC1, cv::Scalar(0)), cv::Mat(480, 640, CV_8UC1, cv::Scalar(0))};
  const cv::Point3d dot(0.75, 0.5, z);  // in the frame of the left camera
  cv::Mat rotation;
  cv::Rodrigues(s.r, rotation);
  for (int side = 0; side < 2; ++side) {
    std::vector<cv::Point2d> at;
    cv::projectPoints(std::vector<cv::Point3d>{dot}, side ? rotation : cv::Mat::zeros(3, 1, CV_64F),
                      side ? s.t : cv::Mat::zeros(3, 1, CV_64F), side ? s.k2 : s.k1, side ? s.d2 : s.d1, at);
    for (int y = 0; y < 480; ++y) {  // a blob, so that its centre of mass is exact to a fraction of a pixel
      for (int x = 0; x < 640; ++x) {
        const double d2 = (x - at[0].x) * (x - at[0].x) + (y - at[0].y) * (y - at[0].y);
        raw[side].at<uint8_t>(y, x) = static_cast<uint8_t>(std::lround(250 * std::exp(-d2 / 18)));
      }
    }
  }
  const RectifiedPair pair = rectify_pair(c, from_mat(raw[0]), from_mat(raw[1]));
  cv::Point2d centre[2];
  for (int side = 0; side < 2; ++side) {
    const Gray& image = side ? pair.right : pair.left;
    double sum = 0;
    for (int y = 0; y < image.height; ++y) {
      for (int x = 0; x < image.width; ++x) {
        sum += image.at(x, y);
        centre[side] += cv::Point2d(x, y) * static_cast<double>(image.at(x, y));
      }
    }
    REQUIRE(sum > 0);
    centre[side] /= sum;
  }
  CHECK(std::abs(centre[0].y - centre[1].y) < 0.1);
  // Depth of the dot along the rectified axis: third component of R1 * dot.
  const cv::Mat turned = s.r1 * (cv::Mat_<double>(3, 1) << dot.x, dot.y, dot.z);
  const double disparity = centre[0].x - centre[1].x - (pair.rig.left.cx - pair.rig.right.cx);
  CHECK(pair.rig.left.fx * pair.rig.baseline / disparity == Approx(turned.at<double>(2)).epsilon(0.005));

  CHECK(read_calibration(dir / "raw.yml", Rectify::kYes).kind == CalibrationKind::kRaw);
  CHECK_THAT(message_of([&] { read_calibration(dir / "raw.yml", Rectify::kNo); }),
             contains("raw.yml: not a calibration"));
}

TEST_CASE("calibration: --rectify decides where a file holds raw cameras and projections", "[io][calibration]") {
  const TemporaryDir dir;
  const Stereo s(cv::CALIB_ZERO_DISPARITY);
  {
    cv::FileStorage f((dir / "all.yml").string(), cv::FileStorage::WRITE);
    f << "K1" << s.k1 << "D1" << s.d1 << "K2" << s.k2 << "D2" << s.d2 << "R" << s.r << "T" << s.t;
    f << "P1" << s.p1 << "P2" << s.p2 << "Q" << s.q;
  }
  CHECK(read_calibration(dir / "all.yml", Rectify::kYes).kind == CalibrationKind::kRaw);
  CHECK(read_calibration(dir / "all.yml", Rectify::kNo).kind == CalibrationKind::kProjection);
}

TEST_CASE("size of images and calibration", "[io][calibration][error]") {
  Calibration c;
  c.source = "c.yaml";
  adopt_size(c, "left.png", 64, 48);
  CHECK(c.rig.width == 64);
  CHECK(c.rig.height == 48);
  CHECK_THAT(message_of([&] { adopt_size(c, "left.png", 64, 49); }),
             contains("left.png: the image is 64x49, but c.yaml (fields 'width', 'height') says 64x48"));
}

TEST_CASE("disparity range without calibration", "[io][calibration]") {
  const Calibration c = disparity_range_calibration(4, 40, 300, 200);
  CHECK_FALSE(c.metric);
  const PlaneSpacing p = planes_for(c.rig, *c.search);
  const double fb = c.rig.left.fx * c.rig.baseline;
  CHECK(fb / p.zmin == Approx(40));
  CHECK(fb / p.zmax == Approx(4));
  CHECK(fb / p.depth(0) - fb / p.depth(1) <= 0.75);
}

TEST_CASE("left disparity: a slanted surface has no cracks, the nearer surface wins", "[io][reprojection]") {
  Rig rig;
  rig.width = 80;
  rig.height = 6;
  rig.left = {100, 100, 39.5, 2.5};
  rig.right = {100, 100, 42.0, 2.5};
  rig.baseline = 0.1;
  FloatImage depth(80, 6, kInf);
  const Camera eye = rig.cyclopean();
  // Surface whose disparity grows by 0.3 px per cell: left columns are 1.15 apart.
  for (int u = 10; u < 60; ++u) depth.at(u, 3) = static_cast<float>(10 / (4 + 0.3 * (u - 10)));
  const FloatImage d = left_disparity(rig, depth);
  int filled = 0;
  double worst = 0;
  for (int x = 0; x < 80; ++x) {
    if (!std::isfinite(d.at(x, 3))) continue;
    ++filled;
    // Invert: total disparity t = f b / z, left column = u - eye.cx + t/2 + left.cx, t = 4 + 0.3 (u - 10).
    const double u = (x - rig.left.cx + eye.cx - (4 - 3) / 2.0) / 1.15;
    const double expected = 4 + 0.3 * (u - 10) - 2.5;
    worst = std::max(worst, std::abs(d.at(x, 3) - expected));
  }
  CHECK(filled >= 57);
  CHECK(filled <= 59);
  CHECK(worst < 0.16);  // the two ends are not interpolated: at most half a pixel off, 0.13 px of disparity
  for (int x = 0; x < 80; ++x) CHECK(d.at(x, 2) == kInf);
  bool inside = false, gap = false;
  for (int x = 0; x < 80; ++x) {
    if (std::isfinite(d.at(x, 3))) {
      CHECK_FALSE(gap);
      inside = true;
    } else if (inside) {
      gap = true;
    }
  }

  FloatImage two(80, 6, kInf);
  two.at(30, 1) = 1.0f;  // total disparity 10: left column 30 - 40.75 + 5 + 39.5 = 33.75 -> 34
  two.at(34, 1) = 5.0f;  // total disparity 2: left column 33.75 as well
  const FloatImage won = left_disparity(rig, two);
  CHECK(won.at(34, 1) == Approx(10 - 2.5));
}

TEST_CASE("left disparity: unequal focal lengths leave no empty rows", "[io][reprojection]") {
  Rig rig;
  rig.width = 60;
  rig.height = 50;
  rig.left = {130, 130, 29.5, 24.5};
  rig.right = {100, 100, 29.5, 24.5};
  rig.baseline = 0.05;
  const FloatImage d = left_disparity(rig, FloatImage(60, 50, 2.0f));
  for (int y = 0; y < 50; ++y) CHECK(std::isfinite(d.at(30, y)));
}

TEST_CASE("point cloud: geometry and grey", "[io][reprojection]") {
  Rig rig;
  rig.width = rig.height = 41;
  rig.left = rig.right = {100, 100, 20, 20};
  rig.baseline = 0.1;
  FloatImage depth(41, 41, kInf), mncc(41, 41, 0.25f);
  depth.at(10, 30) = 2.0f;
  mncc.at(10, 30) = 0.75f;
  Gray left(41, 41, 9);
  left.at(12, 30) = 100;  // 10 + 100 * 0.05 / 2 = 12.5: halfway between 100 and 200
  left.at(13, 30) = 200;
  const auto cloud = point_cloud(rig, depth, mncc, left);
  REQUIRE(cloud.size() == 1);
  CHECK(cloud[0].x == Approx(-0.2f));
  CHECK(cloud[0].y == Approx(0.2f));
  CHECK(cloud[0].z == 2.0f);
  CHECK(cloud[0].grey == 150);
  CHECK(cloud[0].confidence == 0.75f);
}

TEST_CASE("output directory: all or nothing", "[io][output]") {
  const TemporaryDir dir;
  const fs::path target = dir / "deep/out";
  SECTION("without commit nothing stays") {
    try {
      OutputDir out(target);
      write_file(out.file("a"), "1");
      throw InputError("stop");
    } catch (const InputError&) {
    }
    CHECK_FALSE(fs::exists(target));
    CHECK(fs::is_empty(dir / "deep"));
  }
  SECTION("commit creates, then replaces; stale names vanish, others stay") {
    {
      OutputDir out(target.string() + "/");
      write_file(out.file("a"), "1");
      write_file(out.file("old"), "1");
      out.commit();
    }
    write_file(target / "mine", "kept");
    {
      OutputDir out(target);
      write_file(out.file("a"), "2");
      CHECK(read_file(target / "a") == "1");
      out.commit({"a", "old"});
    }
    CHECK(read_file(target / "a") == "2");
    CHECK_FALSE(fs::exists(target / "old"));
    CHECK(read_file(target / "mine") == "kept");
    CHECK(std::distance(fs::directory_iterator(dir / "deep"), fs::directory_iterator()) == 1);
  }
  SECTION("a file in the way is refused") {
    write_file(dir / "file", "x");
    CHECK_THAT(message_of([&] { OutputDir out(dir / "file"); }), contains("file: exists and is not a directory"));
    CHECK_THAT(message_of([&] { OutputDir out(dir / "file/below"); }), contains("cannot create"));
  }
}

TEST_CASE("progress line", "[io][progress]") {
  CHECK(progress_line("rtl", 1, 4, 30) == "rtl [#######.......................]  25 %  1:30 left");
  CHECK(progress_line("rtl", 0, 4, 30) == "rtl [..............................]   0 %  -:-- left");
  CHECK(progress_line("rtl", 9, 4, 30) == "rtl [##############################] 100 %  0:00 left");
}

TEST_CASE("pictures: colours follow depth, holes are grey", "[io][picture]") {
  FloatImage depth(200, 150, 1.0f);
  depth.at(0, 0) = 4.0f;
  depth.at(1, 0) = kInf;
  const cv::Mat p = depth_picture(depth, {301, 1.0, 4.0});
  CHECK(p.cols > 200);
  const auto at = [&](int x, int y) { return p.at<cv::Vec3b>(y, x); };
  CHECK(at(5, 5)[2] > 2 * at(5, 5)[0]);  // near: red
  CHECK(at(0, 0)[2] < at(5, 5)[2]);
  CHECK(std::abs(at(1, 0)[0] - at(1, 0)[2]) < 12);  // grey
  CHECK(at(1, 0) != at(0, 0));
  // The legend: near end and far end of the bar have the colours of the picture.
  CHECK(at(200 + 14 + 5, 150 - 10) == at(5, 5));
  CHECK(at(200 + 14 + 5, 26) == at(0, 0));
}
