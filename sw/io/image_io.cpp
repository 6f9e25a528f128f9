// SPDX-License-Identifier: Apache-2.0
#include "io/image_io.hpp"

#include <fcntl.h>
#include <unistd.h>

#include <opencv2/core/utils/logger.hpp>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "core/error.hpp"
#include "io/text_file.hpp"

namespace psweep {
namespace {

// libpng and OpenCV print to stderr from inside; for the time of a decode it goes nowhere, since the exception says
// all.
class StderrMuted {
 public:
  StderrMuted() : saved_(dup(2)) {
    const int null = open("/dev/null", O_WRONLY);
    if (null >= 0) {
      dup2(null, 2);
      close(null);
    }
  }
  ~StderrMuted() {
    if (saved_ >= 0) {
      dup2(saved_, 2);
      close(saved_);
    }
  }
  StderrMuted(const StderrMuted&) = delete;
  StderrMuted& operator=(const StderrMuted&) = delete;

 private:
  int saved_;
};

// A PNG or TIFF cut off after its last needed row still decodes; the missing end chunk shows that it was cut.
bool cut_off(const std::string& bytes) {
  const std::string png("\x89PNG\r\n\x1a\n", 8);
  return bytes.compare(0, 8, png) == 0 && bytes.find("IEND") == std::string::npos;
}

const char* depth_name(int depth) {
  switch (depth) {
    case CV_8S:
      return "signed 8-bit";
    case CV_16U:
    case CV_16S:
      return "16-bit";
    case CV_32S:
      return "32-bit";
    default:
      return "floating-point";
  }
}

}  // namespace

Gray read_gray(const std::filesystem::path& path) {
  const std::string bytes = read_file(path);
  if (bytes.empty()) throw InputError(path.string() + ": the file is empty, expected an 8-bit image");
  cv::Mat decoded;
  if (!cut_off(bytes)) {
    const StderrMuted muted;
    try {
      const cv::Mat raw(1, static_cast<int>(bytes.size()), CV_8UC1, const_cast<char*>(bytes.data()));
      decoded = cv::imdecode(raw, cv::IMREAD_UNCHANGED);
    } catch (const cv::Exception&) {
      decoded.release();
    }
  }
  if (decoded.empty()) {
    throw InputError(path.string() + ": not an image, truncated or damaged; expected 8-bit PNG, PGM, PPM or TIFF");
  }
  if (decoded.depth() != CV_8U) {
    throw InputError(path.string() + ": " + depth_name(decoded.depth()) +
                     " image; expected 8 bits a channel (convert it first, choosing the scaling yourself)");
  }
  cv::Mat gray;
  if (decoded.channels() == 1) {
    gray = decoded;
  } else if (decoded.channels() == 3) {
    cv::cvtColor(decoded, gray, cv::COLOR_BGR2GRAY);
  } else if (decoded.channels() == 4) {
    cv::cvtColor(decoded, gray, cv::COLOR_BGRA2GRAY);
  } else {
    throw InputError(path.string() + ": " + std::to_string(decoded.channels()) + " channels; expected 1, 3 or 4");
  }
  return from_mat(gray);
}

Gray from_mat(const cv::Mat& mat) {
  Gray out(mat.cols, mat.rows);
  for (int y = 0; y < mat.rows; ++y) std::copy_n(mat.ptr<uint8_t>(y), mat.cols, out.row(y));
  return out;
}

void write_png(const std::filesystem::path& path, const cv::Mat& picture) {
  std::vector<uint8_t> bytes;
  if (!cv::imencode(".png", picture, bytes)) throw InputError(path.string() + ": PNG encoder failed");
  write_file(path, std::string(bytes.begin(), bytes.end()));
}
void write_png(const std::filesystem::path& path, const Gray& picture) { write_png(path, as_mat(picture)); }

void silence_opencv() {
  cv::utils::logging::setLogLevel(cv::utils::logging::LOG_LEVEL_SILENT);
  cv::redirectError([](int, const char*, const char*, const char*, int, void*) { return 0; });
}

}  // namespace psweep
