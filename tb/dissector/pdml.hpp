// SPDX-License-Identifier: Apache-2.0
// What tshark makes of a capture file: runs it with the dissector under test and reads its PDML (XML, one element a
// line) into one Dissection per frame.
//   A Field of it has the name, place and value that tshark gives: `at` and `size` in bytes of the UDP payload (of a
//   generated field -1, 0), `show` as decimal number where it is a number or boolean, else as tshark writes it.
//   `raw` are the bytes that tshark took for it, in hex, where it says so.
// Errors: run() throws std::runtime_error, with tshark's words, if tshark fails or the script has an error.
#pragma once
#include <unistd.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <map>
#include <sstream>
#include <stdexcept>
#include <string>
#include <vector>

#include "desk/pcap.hpp"
#include "support/temporary_dir.hpp"

namespace psweep::tb {

struct Field {
  std::string name;
  long at = -1, size = 0;
  std::string show, raw;

  // What is compared; raw is checked against the message itself.
  std::string text() const {
    return name + " = " + show + (at < 0 ? "" : " @" + std::to_string(at) + "+" + std::to_string(size));
  }
};

struct Dissection {
  long frame = 0;
  bool psweep = false;
  std::string info;  // Info column, as the protocol's line repeats it
  std::vector<Field> fields;
  std::vector<std::string> experts;  // without "psweep.expert."

  const Field* find(const std::string& name) const {
    const auto at = std::find_if(fields.begin(), fields.end(), [&](const Field& f) { return f.name == name; });
    return at == fields.end() ? nullptr : &*at;
  }
  std::string show(const std::string& name) const {
    const Field* f = find(name);
    return f ? f->show : "";
  }
  bool expert(const std::string& name) const {
    return std::find(experts.begin(), experts.end(), name) != experts.end();
  }
};

constexpr long kPayload = 42;  // Ethernet, IPv4, UDP

class Tshark {
 public:
  // dir: a fresh one; tshark finds no preferences and plugins of whoever runs this, and the dissector is copied there.
  explicit Tshark(const TemporaryDir& dir) : dir_(dir) {
    namespace fs = std::filesystem;
    // Wireshark 4.4 runs no scripts for root, so root becomes nobody, who has to be able to read what is in there.
    fs::permissions(dir.path(), fs::perms(0755));
    fs::copy_file(PSWEEP_DISSECTOR, script(), fs::copy_options::overwrite_existing);
    fs::permissions(script(), fs::perms(0644));
    const std::string nobody = "setpriv --reuid=65534 --regid=65534 --clear-groups ";
    if (geteuid() == 0 && std::system((nobody + "true > /dev/null 2>&1").c_str()) == 0) as_ = nobody;
  }

  // Why there is nothing to be tested here; empty if there is. Whether this script is good makes no difference.
  std::string obstacle() {
    if (std::system("command -v tshark > /dev/null 2>&1") != 0) return "tshark is not installed";
    // A protocol's name is a filter, and tshark refuses one that it does not know.
    const std::string probe = (dir_ / "probe.lua").string(), empty = (dir_ / "probe.pcap").string();
    std::ofstream(probe) << "Proto('psweep_probe', 'psweep probe')\n";
    chip::PcapWriter(empty).close();
    const std::string command =
        environment() + "tshark -X 'lua_script:" + probe + "' -r '" + empty + "' -Y psweep_probe > /dev/null 2>&1";
    if (std::system(command.c_str()) != 0) return "this tshark runs no Lua scripts, or not for this user";
    return "";
  }

  // Output of tshark with these options. Only in two passes requests know their replies.
  std::string run(const std::string& pcap, const std::string& options, bool two_passes = true) {
    const std::string out = (dir_ / "tshark.out").string(), log = (dir_ / "tshark.log").string();
    const std::string command = environment() + "tshark -n " + (two_passes ? "-2 " : "") +
                                "-X 'lua_script:" + script() + "' -r '" + pcap + "' " + options + " > '" + out +
                                "' 2> '" + log + "'";
    const int code = std::system(command.c_str());
    const std::string said = slurp(log);
    if (code != 0 || said.find("Lua") != std::string::npos || said.find(".lua") != std::string::npos)
      throw std::runtime_error(command + "\n" + said);
    return slurp(out);
  }

  std::vector<Dissection> dissect(const std::string& pcap, const std::string& options = "", bool two_passes = true) {
    const std::string text = run(pcap, "-T pdml -J psweep " + options, two_passes);
    // A truncated message has a hidden _ws.malformed by its expert info; the packet that broke a dissector, this one.
    for (const char* wrong : {"Lua Error", "_ws.lua.error", "[Malformed Packet", "Dissector bug"}) {
      const size_t at = text.find(wrong);
      if (at != std::string::npos) throw std::runtime_error("tshark: " + text.substr(at, 200));
    }
    return parse(text);
  }

 private:
  std::string script() const { return (dir_ / "psweep.lua").string(); }
  std::string environment() const {
    return as_ + "env XDG_CONFIG_HOME='" + dir_.path().string() + "' HOME='" + dir_.path().string() + "' ";
  }

  static std::string slurp(const std::string& file) {
    std::ifstream in(file);
    std::ostringstream text;
    text << in.rdbuf();
    return text.str();
  }

  static std::string attribute(const std::string& line, const std::string& name) {
    const std::string key = " " + name + "=\"";
    size_t at = line.find(key);
    if (at == std::string::npos) return "";
    at += key.size();
    std::string value = line.substr(at, line.find('"', at) - at);
    for (const auto& [from, to] : {std::pair<const char*, const char*>{"&lt;", "<"},
                                   {"&gt;", ">"},
                                   {"&quot;", "\""},
                                   {"&#x27;", "'"},
                                   {"&amp;", "&"}})
      for (size_t hit = 0; (hit = value.find(from, hit)) != std::string::npos; hit += std::string(to).size())
        value.replace(hit, std::string(from).size(), to);
    return value;
  }

  // "0x09" and "9" are one number; booleans are 1 and True, by version.
  static std::string normal(const std::string& show) {
    if (show == "True") return "1";
    if (show == "False") return "0";
    if (show.empty() || show.find_first_not_of("0123456789abcdefABCDEFx-") != std::string::npos) return show;
    char* end = nullptr;
    const bool hex = show.size() > 2 && show[0] == '0' && show[1] == 'x';
    const long long number = std::strtoll(show.c_str(), &end, hex ? 16 : 10);
    return *end == 0 ? std::to_string(number) : show;
  }

  static std::vector<Dissection> parse(const std::string& text) {
    std::vector<Dissection> all;
    std::istringstream lines(text);
    bool inside = false;
    for (std::string line; std::getline(lines, line);) {
      const size_t begin = line.find('<');
      if (begin == std::string::npos) continue;
      if (line.compare(begin, 8, "<packet>") == 0) {
        all.emplace_back();
      } else if (line.compare(begin, 7, "<proto ") == 0) {
        const std::string name = attribute(line, "name");
        inside = name == "psweep";
        if (inside) {
          if (all.back().psweep) throw std::runtime_error("psweep twice in a frame");
          all.back().psweep = true;
          const std::string title = attribute(line, "showname");
          all.back().info = title.substr(std::min(title.size(), title.find(", ") + 2));
        }
      } else if (line.compare(begin, 7, "<field ") == 0) {
        const std::string name = attribute(line, "name");
        if (name == "num") all.back().frame = std::stol(attribute(line, "show"));
        if (!inside || name.compare(0, 7, "psweep.") != 0) continue;
        if (name.compare(0, 14, "psweep.expert.") == 0) {
          all.back().experts.push_back(name.substr(14));
          continue;
        }
        Field f;
        f.name = name;
        f.size = std::stol(attribute(line, "size"));
        if (f.size > 0) f.at = std::stol(attribute(line, "pos")) - kPayload;
        f.show = normal(attribute(line, "show"));
        f.raw = attribute(line, "unmaskedvalue");
        if (f.raw.empty()) f.raw = attribute(line, "value");
        all.back().fields.push_back(f);
      }
    }
    return all;
  }

  const TemporaryDir& dir_;
  std::string as_;
};

}  // namespace psweep::tb
