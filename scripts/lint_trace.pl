#!/usr/bin/env perl
# SPDX-License-Identifier: Apache-2.0
# docs/traceability.md: requirement, where it is implemented, what shows it; everything that it names has to exist.
#
#   scripts/lint_trace.pl [--page FILE]
#
# Rows of the tables '| requirement | source | implemented in | shown by |'. Implemented in: files or folders in
# backticks. Shown by, in backticks: `make TARGET ..`, `lint CHECK`, `test_x` (tb/**/test_x.cpp), `test_x "regex"`
# (names of its TEST_CASEs) or `ctest "regex"` (names given to add_test or rtl_must_not_elaborate); at least one. Every
# tb/**/test_*.cpp has to be referenced.
use strict;
use warnings;
use File::Find;

my $page = 'docs/traceability.md';
while (@ARGV) {
    my $argument = shift;
    if ($argument =~ /^(-h|--help)$/) { open my $self, '<', $0; <$self>;
        while (<$self>) { last unless s/^# ?//; print unless /^SPDX/ } exit 0 }
    elsif ($argument eq '--page') { $page = shift // die "lint_trace: --page needs a file\n" }
    else { die "lint_trace: unknown argument $argument\n" }
}
my $bad = 0;
sub complain { print "@_\n"; $bad = 1 }
sub slurp { my $file = shift; open my $in, '<', $file or die "lint_trace: $file: $!\n"; local $/; return <$in> }

my (%cases, @ctests, %used);
find(sub {
    if (/^(test_\w+)\.cpp$/) {
        my $program = $1;
        my @names;
        my $text = slurp($_);
        # Adjacent literals are one name.
        while ($text =~ /TEST_CASE(?:_\w+)?\(\s*((?:"(?:[^"\\]|\\.)*"\s*)+)/g) {
            my $name = join '', $1 =~ /"((?:[^"\\]|\\.)*)"/g;
            push @names, $name;
        }
        $cases{$program} = \@names;
        complain("$File::Find::name: no TEST_CASE was found") unless @names;
    }
    if (/^CMakeLists\.txt$|\.cmake$/) {
        my $text = slurp($_);
        # Variables in a name stand for anything.
        while ($text =~ /(?:add_test\(\s*NAME|rtl_must_not_elaborate\()\s*"([^"]+)"/g) { push @ctests, $1 }
    }
}, 'tb');
my %target = map { $_ => 1 } slurp('Makefile') =~ /^([a-z][a-z-]*):/mg;
my ($checks) = slurp('scripts/lint.sh') =~ /^checks=\(([^)]*)\)/m;
my %check = map { $_ => 1 } split ' ', $checks // '';

sub shows {
    my ($token, $place) = @_;
    if ($token =~ /^make ([a-z-]+)\b/) {
        return 1 if $target{$1};
        complain("$place: no make target '$1'");
    } elsif ($token =~ /^lint (\w+)$/) {
        return 1 if $check{$1};
        complain("$place: no check '$1' in scripts/lint.sh");
    } elsif ($token =~ /^ctest "(.+)"$/) {
        my $regex = $1;
        # The variable part of a registered name stands for one word.
        return 1 if grep { (my $name = $_) =~ s/\$\{\w+\}/NAME/g; $name =~ /$regex/ } @ctests;
        complain("$place: no add_test has a name like \"$regex\"");
    } elsif ($token =~ /^(test_\w+)(?: "(.+)")?$/) {
        my ($program, $regex) = ($1, $2);
        if (!$cases{$program}) { complain("$place: no test program '$program' in tb/"); return 0 }
        $used{$program} = 1;
        return 1 if !defined $regex || grep { /$regex/ } @{$cases{$program}};
        complain("$place: no test of $program has a name like \"$regex\"");
    } else {
        complain("$place: '$token' is no test");
    }
    return 0;
}

my (%seen, $in_table, $number);
for my $line (split /\n/, slurp($page)) {
    $number++;
    if ($line !~ /^\|/) { $in_table = 0; next }
    my @cells = split /\s*(?<!\\)\|\s*/, $line;
    shift @cells;
    if (join('|', @cells) eq 'requirement|source|implemented in|shown by') { $in_table = 1; next }
    next if !$in_table || $line =~ /^[-|: ]+$/;
    my $place = "$page:$number";
    if (@cells != 4) { complain("$place: " . scalar(@cells) . ' cells instead of 4'); next }
    my ($name) = $cells[0] =~ /^(R-[A-Z]+-\d\d) \S/;
    if (!$name) { complain("$place: a requirement begins with R-AREA-00 and a text"); next }
    complain("$place: $name a second time") if $seen{$name}++;
    my @files = $cells[2] =~ /`([^`]+)`/g;
    complain("$place: $name is implemented nowhere") unless @files;
    -e $_ or complain("$place: $_ does not exist") for @files;
    my $tests = 0;
    $tests += shows($_, $place) for $cells[3] =~ /`([^`]+)`/g;
    complain("$place: nothing shows $name") unless $tests;
}
$used{$_} or complain("$page: $_ is not referenced") for sort keys %cases;
complain('lint_trace: nothing was checked') unless %seen && %cases && %target && %check;
exit $bad;
