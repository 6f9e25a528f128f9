# SPDX-License-Identifier: Apache-2.0
# The work of scripts/mutants.sh: finds the places where a fault can be put, draws some, builds and tests each.
# A mutant is drawn by the hash of its text, not by its place in a list: editing one line leaves the draw elsewhere.
use strict;
use warnings;
use Cwd qw(getcwd);
use Digest::MD5 qw(md5_hex);
use Fcntl qw(:flock);
use File::Basename qw(dirname);
use File::Find qw(find);
use File::Path qw(make_path);
use POSIX ":sys_wait_h";

my $root = getcwd();
my $dir  = "$root/build/mutants";
my $list_file = 'scripts/mutants_equivalent.txt';
my ($count, $seed, $only, $list, $strict, @wanted) = (100, 1, '', 0, 0);
while (@ARGV) {
  my $arg = shift @ARGV;
  if    ($arg eq '--count')  { $count = shift @ARGV }
  elsif ($arg eq '--seed')   { $seed  = shift @ARGV }
  elsif ($arg eq '--only')   { $only  = shift @ARGV }
  elsif ($arg eq '--list')   { $list  = 1 }
  elsif ($arg eq '--strict') { $strict = 1 }
  elsif ($arg =~ /^[a-z]\w*$/) { push @wanted, $arg }
  else { die "mutants: unknown argument '$arg'; see scripts/mutants.sh --help\n" }
}
die "mutants: --count wants a number\n" unless defined $count && $count =~ /^\d+$/;
die "mutants: --seed wants a number\n"  unless defined $seed  && $seed  =~ /^\d+$/;

# Which tests look at an entity, in order, ' : ' and names of cases where not all of a program are wanted. Waves are
# left out of these builds, so the case of test_chip that opens some is, too; and so are the two largest engines. Last
# the original VHDL in GHDL, which checks bounds and assertions: a recording of the mutant, replayed on the mutant.
my @engine = ('test_errors', 'test_engine', 'test_rtl_engine : rtl engine: extreme*', 'elaboration : ^psweep: G_',
              'record_engine : ^replay: (tiny|odd|rectified),');
my @chip   = ('test_fuzz', 'test_chip : ~chip: recording*', 'record_chip : ^replay: chip_odd,');
my %of_ctest = (record_engine => ['record_engine', 'psweep_replay'],
                record_chip   => ['record_chip', 'psweep_top_replay'],
                elaboration   => []);
my %first  = (
  psweep_pkg => ['test_address_generator', 'test_ram_deep', 'test_ram_2r', 'test_storage', 'test_updating'],
  eth_pkg    => ['test_mac_rx', 'test_mac_tx', 'test_packet_rx'],
);
my %folder = (test_errors => 'engine', test_engine => 'engine', test_rtl_engine => 'engine', test_fuzz => 'chip',
              test_chip => 'chip', record_engine => 'replay', record_chip => 'replay',
              elaboration => 'engine');

# The entities -----------------------------------------------------------------------------------------------------
my (@entities, %chain, %text);
my $in_chip = 0;
for my $line (lines_of('rtl/files.f')) {
  next unless $line =~ /^(\w+)\.vhd/;
  my $name = $1;
  push @entities, $name;
  $text{$name} = [lines_of("rtl/$name.vhd")];
  my @tests = $first{$name} ? @{$first{$name}} : -e "tb/units/test_$name.cpp" ? ("test_$name") : ();
  # What the chip adds has no influence on the engine; what the engine's tests let pass, the chip's may see.
  $chain{$name} = [@tests, $in_chip ? @chip : @engine];
  $in_chip = 1 if $name eq 'psweep';
}
die "mutants: rtl/files.f names no file\n" unless @entities;
for my $name (@wanted) { die "mutants: no entity $name in rtl/files.f\n" unless $chain{$name} }
@wanted = @entities unless @wanted;

sub lines_of {
  my ($file) = @_;
  open my $in, '<', $file or die "$file: $!\n";
  my @l = <$in>;
  close $in;
  chomp @l;
  return @l;
}

# The candidates of a file -----------------------------------------------------------------------------------------
# Left alone: declarations of entities (defaults of generics, ports), of signals and types, assertions (illegal generics
# have tests of their own) and what is not synthesised.
my $declaration = qr/^\s*(signal|type|subtype|attribute|port|use|library|function|procedure|architecture|package|end
                            |shared|variable)\b/xi;
my $token = qr/x?"[^"]*"|'[01XZ-]'|\d+\#\w+\#|[a-zA-Z]\w*'\w+|[a-zA-Z]\w*|\d+|<=|>=|\/=|=>|:=|\*\*|./;
sub candidates {
  my ($name) = @_;
  my @found;
  my ($skip, $hidden, $process, $body) = ('', 0, 0, 0);
  my ($condition, $assigned, $depth) = (0, 0, 0);  # of the statement
  my %seen;
  for my $number (0 .. $#{$text{$name}}) {
    my $line = $text{$name}[$number];
    $hidden = 1 if $line =~ /translate_off/;
    if ($hidden) { $hidden = 0 if $line =~ /translate_on/; next }
    (my $code = $line) =~ s/--.*//;
    next unless $code =~ /\S/;
    if ($skip) { $skip = '' if $code =~ /$skip/i; next }
    if ($code =~ /^\s*entity\s+\w+\s+is/i)     { $skip = '^\s*end\s+entity'; next }
    if ($code =~ /^\s*assert\b/i)              { $skip = ';\s*$' unless $code =~ /;\s*$/; next }
    if ($code =~ $declaration) {
      $process = 0 if $code =~ /^\s*end\s+(process|function)/i;
      $process = 1 if $code =~ /^\s*function\b/i && $code =~ /\bis\b/;
      next if $code !~ /^\s*(function|procedure)\b/i && ($code =~ /;\s*$/ || $code =~ /\b(is|port)\b/i);
      next if $code =~ /^\s*(function|procedure)\b/i;
      $skip = ';\s*$'; next;
    }
    $process = 1 if $code =~ /\bprocess\b/i;
    next if $code =~ /\bprocess\b/i;
    my $occurrence = $seen{trimmed($line)}++;
    my $add = sub {
      my ($rule, $after) = @_;
      push @found, {entity => $name, line => $number, rule => $rule, before => $line, after => $after,
                    hash => md5_hex("$seed|$name|$line|$occurrence|$after"), nth => $occurrence};
    };
    # Tokens.
    my @t;
    while ($code =~ /\G(?:(\s+)|($token))/gc) {
      push @t, {s => $2, at => $-[2]} if defined $2;
    }
    my $replace = sub {
      my ($i, $new) = @_;
      my $after = $line;
      substr($after, $t[$i]{at}, length $t[$i]{s}) = $new;
      return $after;
    };
    my $is_clock = $code =~ /(rising|falling)_edge/;
    for my $i (0 .. $#t) {
      my $s = $t[$i]{s};
      my $previous = $i ? $t[$i - 1]{s} : '';
      my $next = $i < $#t ? $t[$i + 1]{s} : '';
      my $low = lc $s;
      $depth++ if $s eq '(';
      $depth-- if $s eq ')';
      if ($low =~ /^(if|elsif|when|while|return)$/) { $condition = 1 }
      elsif ($s eq ';' || $low =~ /^(then|loop|generate|begin)$/) {
        $condition = $assigned = 0;
        $depth = 0 if $s eq ';';
      }
      elsif ($low eq 'else') { $condition = 0 }
      if ($is_clock) { next }
      if ($s eq '=')     { $add->('compare', $replace->($i, '/=')) }
      elsif ($s eq '/=') { $add->('compare', $replace->($i, '=')) }
      elsif ($s eq '<')  { $add->('compare', $replace->($i, '<=')) }
      elsif ($s eq '>')  { $add->('compare', $replace->($i, '>=')) }
      elsif ($s eq '>=') { $add->('compare', $replace->($i, '>')) }
      elsif ($s eq '<=') {
        if ($condition || $assigned || $depth > 0) { $add->('compare', $replace->($i, '<')) }
        $assigned = 1;
      }
      elsif ($s eq ':=') { $assigned = 1 }
      elsif (($s eq '+' || $s eq '-') && $previous =~ /^(\w+|\)|\w+'\w+)$/
             && !($t[$i + 2] && $t[$i + 2]{s} =~ /^(downto|to)$/i)) {
        $add->('arithmetic', $replace->($i, $s eq '+' ? '-' : '+'));
      }
      elsif ($low eq 'and') { $add->('logic', $replace->($i, 'or')) }
      elsif ($low eq 'or')  { $add->('logic', $replace->($i, 'and')) }
      elsif ($low eq 'xor') { $add->('logic', $replace->($i, 'or')) }
      elsif ($low eq 'not') { $add->('logic', $replace->($i, '')) }
      elsif ($low eq 'true')  { $add->('constant', $replace->($i, 'false')) }
      elsif ($low eq 'false') { $add->('constant', $replace->($i, 'true')) }
      elsif ($s eq "'0'") { $add->('constant', $replace->($i, "'1'")) }
      elsif ($s eq "'1'") { $add->('constant', $replace->($i, "'0'")) }
      elsif ($s =~ /^"([01]+)"$/) {
        my $bit = hex(substr(md5_hex("$line$i"), 0, 4)) % length $1;
        my $value = $1;
        substr($value, $bit, 1) =~ tr/01/10/;
        $add->('constant', $replace->($i, "\"$value\""));
      }
      elsif ($s =~ /^x"([0-9A-F]+)"$/i) {
        my $value = $1;
        my $digit = hex(substr(md5_hex("$line$i"), 0, 4)) % length $value;
        substr($value, $digit, 1) = sprintf '%X', hex(substr $value, $digit, 1) ^ 1;
        $add->('constant', $replace->($i, "x\"$value\""));
      }
      elsif ($s =~ /^\d+$/ && $previous !~ /^(downto|to)$/i && $next !~ /^(downto|to)$/i) {
        $add->('number', $replace->($i, $s + 1));
        $add->('number', $replace->($i, $s - 1)) if $s > 0;
      }
      elsif ($low eq 'downto' && $previous =~ /^\d+$/ && $next =~ /^\d+$/ && $i > 1 && $t[$i - 2]{s} eq "(") {
        # Both bounds, or the widths would differ.
        for my $d (1, -1) {
          next if $next + $d < 0;
          my $after = $line;
          my $from = $t[$i - 1]{at};
          my $to = $t[$i + 1]{at} + length $next;
          substr($after, $from, $to - $from) = ($previous + $d) . ' downto ' . ($next + $d);
          $add->('slice', $after);
        }
      }
    }
    next if $is_clock;
    if ($process && $code =~ /^(\s*)[a-z]\w*(\([^<]*\))?\s*(<=|:=)[^;]*;\s*$/i && $code !~ /^\s*constant\b/i) {
      $add->('deletion', "$1null;");
    }
    if ($code =~ /^(\s*)(if|elsif)\s+(.*\S)\s+then\s*$/i) {
      $add->('branch', "$1$2 false then");
      $add->('branch', "$1$2 true then");
    }
    if ($code =~ /^(\s*\w+\s*(?:<=|:=)\s*)([^;]+?)\s+when\s+([^;]+?)\s+else\s+([^;]+?)\s*;\s*$/i) {
      $add->('branch', "$1$4 when $3 else $2;");
    }
  }
  return @found;
}
sub trimmed { my ($t) = @_; $t =~ s/--.*//; $t =~ s/\s+/ /g; $t =~ s/^ | $//g; return $t }

# In the order of the draw: one rule and one edit a line, then the second of each line, and so on.
sub drawn_order {
  my (%by_line, @ordered);
  push @{$by_line{$_->{line}}}, $_ for @_;
  my @rounds;
  for my $line (keys %by_line) {
    my %by_rule;
    push @{$by_rule{$_->{rule}}}, $_ for sort { $a->{hash} cmp $b->{hash} } @{$by_line{$line}};
    my @rules = sort { md5_hex($by_rule{$a}[0]{hash} . $a) cmp md5_hex($by_rule{$b}[0]{hash} . $b) } keys %by_rule;
    my $round = 0;
    while (@rules) {
      for my $rule (@rules) { push @{$rounds[$round++]}, shift @{$by_rule{$rule}} }
      @rules = grep { @{$by_rule{$_}} } @rules;
    }
  }
  push @ordered, sort { $a->{hash} cmp $b->{hash} } @$_ for @rounds;
  my $number = 0;
  $_->{id} = $_->{entity} . '.' . ++$number for @ordered;
  return @ordered;
}

my (%order, %quota, %size);
my $total_size = 0;  # of square roots: the large ones would leave nothing for the small ones
for my $name (@entities) {
  $order{$name} = [drawn_order(candidates($name))];
  die "mutants: rtl/$name.vhd: no place for a fault\n" unless @{$order{$name}};
  my %lines = map { $_->{line} => 1 } @{$order{$name}};
  $size{$name} = keys %lines;
  $total_size += sqrt $size{$name};
}
for my $name (@entities) {
  my $share = int($count * sqrt($size{$name}) / $total_size + 0.5);
  $quota{$name} = $share < 2 ? 2 : $share;
  $quota{$name} = @{$order{$name}} if $quota{$name} > @{$order{$name}};
}

# The list of equivalents ------------------------------------------------------------------------------------------
# Blocks of four lines: file, '- ' line before, '+ ' line after, reason (which may go on); '#2' behind the file name is
# the second such line of the file.
my %equivalent;
{
  my $key;
  my ($file, $before, $after);
  if (-e $list_file) {
    my $n = 0;
    for my $line (lines_of($list_file)) {
      $n++;
      next if $line =~ /^#/ || $line !~ /\S/;
      if ($line =~ m{^rtl/(\w+)\.vhd(?: #(\d+))?$}) { $file = "$1|" . (($2 // 1) - 1); undef $key; undef $before }
      elsif ($line =~ /^- (.*)/ && $file) { $before = trimmed($1) }
      elsif ($line =~ /^\+ (.*)/ && defined $before) {
        $key = "$file|$before|" . trimmed($1);
        die "mutants: $list_file:$n: twice\n" if $equivalent{$key};
        $equivalent{$key} = {reason => '', where => "$list_file:$n"};
      }
      elsif ($key && $line =~ /^  (\S.*)/) { $equivalent{$key}{reason} .= ($equivalent{$key}{reason} ? ' ' : '') . $1 }
      else { die "mutants: $list_file:$n: not understood\n" }
    }
  }
  for my $e (values %equivalent) { die "mutants: $e->{where}: no reason\n" unless $e->{reason} }
}
sub key_of { my ($m) = @_; return "$m->{entity}|$m->{nth}|" . trimmed($m->{before}) . '|' . trimmed($m->{after}) }
my %exists = map { key_of($_) => 1 } map { @{$order{$_}} } @entities;
my @wrong_entries;
for my $key (sort keys %equivalent) {
  push @wrong_entries, "$equivalent{$key}{where}: fits no line of the RTL" unless $exists{$key};
}

sub shown { my ($m) = @_; return sprintf '%-24s rtl/%s.vhd:%d  %s  ->  %s', $m->{id}, $m->{entity}, $m->{line} + 1,
              trimmed($m->{before}), trimmed($m->{after}) }
if ($list) {
  my ($drawn, $all) = (0, 0);
  for my $name (@wanted) {
    printf "%s: %d of %d, on %d lines\n", $name, $quota{$name}, scalar @{$order{$name}}, $size{$name};
    print '  ', shown($order{$name}[$_]), "\n" for 0 .. $quota{$name} - 1;
    $drawn += $quota{$name};
    $all += @{$order{$name}};
  }
  print "$drawn of $all (those that cannot be built are replaced)\n";
  exit 0;
}

# What to do -------------------------------------------------------------------------------------------------------
my @tasks;  # [entity, first number or 0]
if ($only) {
  my ($name, $number) = $only =~ /^(\w+)\.(\d+)$/ or die "mutants: --only wants ENTITY.NUMBER\n";
  die "mutants: no mutant $only\n" unless $order{$name} && $number >= 1 && $number <= @{$order{$name}};
  $order{$name} = [$order{$name}[$number - 1]];
  $quota{$name} = 1;
  @wanted = ($name);
}
my $to_do = 0;
$to_do += $quota{$_} for @wanted;
# The long ones first. What has no test of its own needs a build of the whole engine or chip.
sub cost { my ($n) = @_; return $quota{$n} * ($chain{$n}[0] =~ /test_(fuzz|errors)/ ? 4 : 1) }
@tasks = sort { cost($b) <=> cost($a) || $a cmp $b } @wanted;

# Copies and builds ------------------------------------------------------------------------------------------------
my $jobs = $ENV{JOBS} || `nproc`;
chomp $jobs;
$jobs = @tasks if $jobs > @tasks;
make_path($dir);
$ENV{CCACHE_NOHASHDIR} = 1;
$ENV{PSWEEP_SEED} = 1 unless defined $ENV{PSWEEP_SEED};
$| = 1;

sub slurp {
  my ($f) = @_;
  open my $in, '<:raw', $f or die "$f: $!\n";
  local $/;
  my $t = <$in>;
  close $in;
  return $t // '';
}
sub spew  { my ($f, $t) = @_; open my $out, '>:raw', $f or die "$f: $!\n"; print $out $t; close $out or die "$f: $!\n" }

# Brings a copy up to date; files that are the same keep their times. Returns a hash of all of it.
sub synchronise {
  my ($from, $tree) = @_;
  my (%wanted_file, @hashes);
  my $take = sub {
    return unless -f $_;
    (my $file = $File::Find::name) =~ s{^\./}{};
    return if $file =~ m{^tb/(chip/)?configs/(tile|bands)\.json$};  # large and slow; no test used here needs them
    $wanted_file{$file} = 1;
    my $content = slurp("$from/$file");
    push @hashes, "$file " . md5_hex($content);
    return if -f "$tree/$file" && -s "$tree/$file" == length $content && slurp("$tree/$file") eq $content;
    make_path(dirname("$tree/$file"));
    spew("$tree/$file", $content);
    chmod((stat "$from/$file")[2] & 07777, "$tree/$file");
  };
  chdir $from or die "$from: $!\n";
  find({wanted => $take, no_chdir => 1}, 'CMakeLists.txt', 'rtl', 'sw', 'tb', 'scripts');
  chdir $root or die "$root: $!\n";
  find({wanted => sub {
    (my $file = $File::Find::name) =~ s{^\Q$tree\E/}{};
    unlink $File::Find::name if -f $File::Find::name && !$wanted_file{$file};
  }, no_chdir => 1}, $tree);
  return md5_hex(join "\n", sort grep { !m{^(scripts/(?!cmake)|tb/(model|waves|dissector)/)} } @hashes);
}

# Runs a command with a time limit, output into a file. Returns its exit code, -1 for the limit, and the seconds.
sub run {
  my ($log, $limit, $append, @command) = @_;
  my $begun = time;
  my $pid = fork // die "fork: $!\n";
  if (!$pid) {
    setpgrp;
    open STDOUT, $append ? '>>' : '>', $log or die "$log: $!\n";
    open STDERR, '>&', \*STDOUT;
    # A mutant may fill memory or disk.
    exec 'bash', '-c', 'ulimit -v 8000000; ulimit -f 400000; exec "$@"', 'bash', @command;
    exit 127;
  }
  my $end = $begun + $limit;
  while (1) {
    my $done = waitpid $pid, WNOHANG;
    if ($done == $pid) { return ($? & 127 ? 128 + ($? & 127) : $? >> 8, time - $begun) }
    if (time > $end) { kill 'KILL', -$pid; waitpid $pid, 0; return (-1, time - $begun) }
    select undef, undef, undef, 0.05;
  }
}

# The program, its targets, the command.
sub test_parts {
  my ($test) = @_;
  my ($program, $filter) = split / : /, $test, 2;
  return ($program, $of_ctest{$program},
          ['ctest', '--test-dir', 'build', '--no-tests=error', '--output-on-failure', '-R', $filter])
    if $of_ctest{$program};
  my $folder = $folder{$program} || 'units';
  return ($program, [$program], ["build/tb/$folder/$program", '-a', defined $filter ? $filter : ()]);
}

sub prepare {
  my ($job) = @_;
  my $at = "$dir/$job";
  make_path("$at/tree");
  $ENV{CCACHE_BASEDIR} = $at;
  # The first copy is what the others are copies of: somebody may go on editing.
  my $hash = synchronise($job == 1 ? $root : "$dir/1/tree", "$at/tree");
  chdir $at or die "$at: $!\n";
  my ($code) = run("$at/configure.log", 300, 0, 'cmake', '-S', 'tree', '-B', 'build', '-G', 'Ninja',
                   '-DPSWEEP_VERILATOR_EXTRA=-Wno-fatal', '-DPSWEEP_FAST_OPTION=-O1',
                   '-DCMAKE_DISABLE_FIND_PACKAGE_ZLIB=ON');
  die "mutants: cmake failed: $at/configure.log\n" if $code != 0;
  chdir $root;
  return $hash;
}

# All copies are made before the first fault is put into one.
my $hash = prepare(1);
prepare($_) for 2 .. $jobs;
for my $name (@entities) {
  die "mutants: rtl/$name.vhd was changed while it was copied\n"
    if slurp("$dir/1/tree/rtl/$name.vhd") ne join("\n", @{$text{$name}}) . "\n";
}

# A test has to pass on the circuit as it is, or to fail would mean nothing. Done when a test is needed for the first
# time; remembered with its time as long as no file changes.
my %seconds;
sub known_baselines {
  return unless -e "$dir/baseline.txt";
  my ($old, @lines) = lines_of("$dir/baseline.txt");
  return unless ($old // '') eq $hash;
  for (@lines) { my ($t, $s) = split /\t/; $seconds{$t} = $s }
}
sub baseline {
  my ($test) = @_;
  locked(\&known_baselines);
  return if defined $seconds{$test};
  my ($program, $targets, $command) = test_parts($test);
  my $log = getcwd() . '/baseline.log';
  my ($code) = @$targets ? run($log, 3600, 0, 'ninja', '-C', 'build', '-j1', @$targets) : (0);
  die "mutants: $program cannot be built: $log\n" if $code != 0;
  ($code, my $took) = run($log, 1800, 0, @$command);
  die "mutants: $test fails on the circuit as it is: $log\n"
    if $code != 0 || slurp($log) !~ /All tests passed \([1-9]|100% tests passed, 0 tests failed out of [1-9]/;
  printf "mutants: the circuit as it is passes %s (%d s)\n", $test, $took;
  locked(sub {
    known_baselines();
    $seconds{$test} = $took;
    spew("$dir/baseline.txt", join "\n", $hash, (map { "$_\t$seconds{$_}" } sort keys %seconds), '');
  });
}

# The mutants ------------------------------------------------------------------------------------------------------
unlink "$dir/results.txt", "$dir/next";
spew("$dir/results.txt", '');
spew("$dir/next", '0');
my $started = time;

sub locked {
  my ($what) = @_;
  open my $lock, '>', "$dir/lock" or die "$dir/lock: $!\n";
  flock $lock, LOCK_EX or die "flock: $!\n";
  my $result = $what->();
  close $lock;
  return $result;
}
sub next_task { return locked(sub { my $n = slurp("$dir/next"); spew("$dir/next", $n + 1); return $n }) }

sub duration { my ($s) = @_; return sprintf '%d:%02d', $s / 60, $s % 60 }

# Result of one mutant, in the file and as a line with the progress.
sub note {
  my ($m, $verdict, $by, $took) = @_;
  locked(sub {
    open my $out, '>>', "$dir/results.txt" or die "results: $!\n";
    print $out join("\t", $verdict, $by, $took, $m->{id}, key_of($m), shown($m)), "\n";
    close $out;
    my $done = grep { !/^invalid/ } lines_of("$dir/results.txt");
    my $left = $done ? (time - $started) / $done * ($to_do - $done) : 0;
    printf "[%d/%d, %s left] %s: %s%s (%d s)\n", $done, $to_do, duration($left), shown($m), $verdict,
      $by ne '-' ? " by $by" : '', $took;
    return 0;
  });
}

sub test_mutant {
  my ($m, $at, $original) = @_;
  my @lines = @$original;
  $lines[$m->{line}] = $m->{after};
  my $file = "$at/tree/rtl/$m->{entity}.vhd";
  my $begun = time;
  my $log = "$at/log.$m->{id}.txt";
  my ($verdict, $by) = ('SURVIVED', '-');
  spew($log, shown($m) . "\n");
  for my $test (@{$chain{$m->{entity}}}) {
    my ($program, $targets, $command) = test_parts($test);
    if (!defined $seconds{$test}) {
      spew($file, join("\n", @$original) . "\n");
      baseline($test);
    }
    spew($file, join("\n", @lines) . "\n");
    my ($code) = @$targets ? run($log, 400, 1, 'ninja', '-C', 'build', '-j1', @$targets) : (0);
    if ($code != 0) { $verdict = 'invalid'; last }
    ($code) = run($log, 20 + 3 * $seconds{$test}, 1, @$command);
    if ($code == -1) { $verdict = 'killed, no end'; $by = $program; last }
    if ($code >= 126 && $code <= 127) { die "mutants: $program cannot be run: $log\n" }
    if ($code != 0) { $verdict = 'killed'; $by = $program; last }
  }
  note($m, $verdict, $by, time - $begun);
  unlink $log if $verdict ne 'SURVIVED' && !$ENV{VERBOSE};
  return $verdict;
}

my @workers;
for my $job (1 .. $jobs) {
  my $pid = fork // die "fork: $!\n";
  if ($pid) { push @workers, $pid; next }
  my $at = "$dir/$job";
  $ENV{CCACHE_BASEDIR} = $at;
  chdir $at or die "$at: $!\n";
  while ((my $n = next_task()) < @tasks) {
    my $name = $tasks[$n];
    my ($valid, $invalid) = (0, 0);
    for my $m (@{$order{$name}}) {
      last if $valid == $quota{$name};
      if (test_mutant($m, $at, $text{$name}) ne 'invalid') { $valid++; $invalid = 0; next }
      die "mutants: $name: nothing can be built any more: $at\n" if ++$invalid == 25;
    }
    spew("$at/tree/rtl/$name.vhd", join("\n", @{$text{$name}}) . "\n");
  }
  exit 0;
}
my $broken = 0;
for my $pid (@workers) { waitpid $pid, 0; $broken++ if $? }

# Summary ----------------------------------------------------------------------------------------------------------
my (%table, %sum, @bad);
my @columns = ('killed by its own test', 'by engine or chip', 'no end', 'equivalent', 'SURVIVED', 'invalid');
for my $line (lines_of("$dir/results.txt")) {
  my ($verdict, $by, $took, $id, $key, $shown) = split /\t/, $line;
  (my $name = $id) =~ s/\..*//;
  my $listed = $equivalent{$key} && !$strict;
  my $column;
  if ($verdict eq 'killed') { $column = $folder{$by} ? $columns[1] : $columns[0] }
  elsif ($verdict =~ /^killed/) { $column = 'no end' }
  elsif ($verdict eq 'invalid') { $column = 'invalid' }
  else { $column = $listed ? 'equivalent' : 'SURVIVED' }
  $table{$name}{$column}++;
  $sum{$column}++;
  push @bad, "survived and is not in $list_file: $shown" if $column eq 'SURVIVED';
  push @bad, "$equivalent{$key}{where}: not equivalent, $by killed it: $shown"
    if $equivalent{$key} && $verdict =~ /^killed/;
}
printf "\n%-20s %8s", 'entity', 'mutants';
printf " | %s", $_ for @columns;
print "\n";
my $tested = 0;
for my $name ((grep { $table{$_} } @entities), 'all') {
  my $row = $name eq 'all' ? \%sum : $table{$name};
  my $n = 0;
  $n += $row->{$_} // 0 for grep { $_ ne 'invalid' } @columns;
  $tested = $n;
  printf "%-20s %8d", $name, $n;
  printf " | %*d", length $_, $row->{$_} // 0 for @columns;
  print "\n";
}
for my $name (@wanted) {
  my $n = 0;
  $n += $table{$name}{$_} // 0 for grep { $_ ne 'invalid' } @columns;
  # Fewer than the quota: all places of a small entity have been tried.
  push @bad, "$name: no mutant could be tested" if $n == 0;
}
push @bad, @wrong_entries;
push @bad, "$broken jobs broke off" if $broken;
push @bad, 'nothing was tested' if $tested == 0;
print "mutants: $_\n" for @bad;
my $killed = $tested - ($sum{equivalent} // 0) - ($sum{SURVIVED} // 0);
printf "mutants: %d tested, %d killed, %d equivalent, %d survived, %d could not be built; %s minutes\n",
  $tested, $killed, $sum{equivalent} // 0, $sum{SURVIVED} // 0, $sum{invalid} // 0, duration(time - $started);
exit(@bad ? 1 : 0);
