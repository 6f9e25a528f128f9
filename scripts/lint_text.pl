#!/usr/bin/perl
# SPDX-License-Identifier: Apache-2.0
# Checks texts line by line, for lint.sh; prints 'file:line: rule: what', exit code 1 if it found anything.
#
#   scripts/lint_text.pl text FILE ...    ASCII, LF, final newline, tabs, trailing blanks, 120 columns, SPDX
#   scripts/lint_text.pl vhdl FILE ...    constructs that GHDL 2.0 turns into wrong Verilog, or that are not VHDL-93
#   scripts/lint_text.pl units FILE ...   every entity has a golden model, a test and a page
#   scripts/lint_text.pl links FILE ...   links of the Markdown files lead to files and headings; docs/README.md has all
#
# Exceptions, each with its reason, are in scripts/lint_waivers.txt; one that matches nothing is an error, too.
use strict;
use warnings;

my $mode = shift // '';
if ($mode !~ /^(text|vhdl|units|links)$/) {
    open my $self, '<', $0 or die;
    while (<$self>) { next if /^#!|SPDX/; last unless s/^# ?//; print }
    exit($mode =~ /^(-h|--help)$/ ? 0 : 2);
}

# Waivers: mode rule file [text], then '|' and the reason.
my @waivers;
open my $in, '<', 'scripts/lint_waivers.txt' or die "scripts/lint_waivers.txt: $!\n";
while (<$in>) {
    next if /^\s*(#|$)/;
    /^(\S+)\s+(\S+)\s+(\S+)\s*(.*?)\s*\|\s*(\S.*)$/
      or die "scripts/lint_waivers.txt:$.: no 'mode rule file [text] | reason'\n";
    push @waivers, { mode => $1, rule => $2, file => $3, text => $4, used => 0, line => $. };
}
close $in;

my $found = 0;
sub finding {
    my ($file, $line, $rule, $what, $text) = @_;
    for my $w (@waivers) {
        next unless $w->{mode} eq $mode && $w->{rule} eq $rule && $w->{file} eq $file;
        next if $w->{text} ne '' && index($text // '', $w->{text}) < 0;
        $w->{used} = 1;
        return;
    }
    print "$file:$line: $rule: $what\n";
    $found = 1;
}

sub slurp {
    my ($file) = @_;
    open my $handle, '<:raw', $file or die "$file: $!\n";
    local $/;
    return <$handle> // '';
}

# --- text ---
# Written in two parts each, or this file would be full of findings.
my $words = join '|', 'TO' . 'DO', 'FIX' . 'ME', 'X' . 'XX', 'HA' . 'CK';
my $homes = join '|', '/wo' . 'rk/', '/ro' . 'ot/', '/ho' . 'me/', '/Us' . 'ers/';

sub check_text {
    my ($file) = @_;
    my $all = slurp($file);
    return if index($all, "\0") >= 0;    # a picture
    if ($all eq '') { finding($file, 1, 'empty', 'the file is empty'); return }
    finding($file, 1, 'newline', 'no newline at the end') if $all !~ /\n\z/;
    finding($file, 1, 'newline', 'blank line at the end') if $all =~ /\n\n\z/;
    my $comments = $file !~ /\.(md|json|yaml|yml|svg|html|pgm|ppm|csv)$|^LICENSE$/;
    my ($head) = $all =~ /\A((?:.*\n){1,3})/;
    finding($file, 1, 'spdx', 'no SPDX-License-Identifier: Apache-2.0 in the first three lines')
      if $comments && ($head // '') !~ /SPDX-License-Identifier: Apache-2\.0/;
    my $number = 0;
    for my $line (split /\n/, $all) {
        $number++;
        finding($file, $number, 'ascii', 'not ASCII', $line) if $line =~ /[^\x00-\x7f]/;
        finding($file, $number, 'lf', 'carriage return', $line) if $line =~ /\r/;
        finding($file, $number, 'tab', 'tab', $line) if $line =~ ($file eq 'Makefile' ? qr/[^\t].*\t/ : qr/\t/);
        finding($file, $number, 'blanks', 'trailing blanks', $line) if $line =~ /[ \t]$/;
        # Rows of a Markdown table and lone links cannot be wrapped.
        my $rigid = $file =~ /\.md$/ && $line =~ /^\s*(\||\[[^\]]*\]: )/;
        finding($file, $number, 'columns', length($line) . ' columns', $line)
          if length($line) > 120 && !$rigid && $file !~ /\.(svg|csv)$/;
        finding($file, $number, 'test_name', 'CTest takes a semicolon or bracket in a test\'s name for a list', $line)
          if $line =~ /TEST_CASE(?:_METHOD)?\("[^"]*[;\[\]][^"]*"/;
        finding($file, $number, 'words', "promises later work: $1", $line) if $line =~ /\b($words)\b/;
        finding($file, $number, 'paths', "path of one machine: $1", $line) if $line =~ m{(?:^|[\s"'=(`])($homes)};
    }
}

# --- vhdl ---
my $reserved = join '|', qw(
  always assign automatic casex casez cell config deassign defparam design disable edge endcase endconfig
  endfunction endgenerate endmodule endprimitive endspecify endtable endtask event force forever fork highz0
  highz1 ifnone incdir include initial inout input instance integer_vector join large liblist localparam
  macromodule medium module negedge nmos noshowcancelled notif0 notif1 output parameter pmos posedge
  primitive pull0 pull1 pulldown pullup rcmos reg release repeat rnmos rpmos rtran small specify specparam
  strong0 strong1 supply0 supply1 table task tran tri tri0 tri1 triand trior trireg uwire vectored wand
  weak0 weak1 wire wor logic bit byte int static unique priority final do
);
my @vhdl_rules = (
    [ 'others', qr/\bwhen\s+others\s*=>(?!\s*null\b)/, 'GHDL 2.0 loses it: list every choice, or use if/elsif' ],
    [ 'with_select', qr/\bwith\b[^;]*\bselect\b/, 'GHDL 2.0 loses the default: use when/else' ],
    [ 'abs', qr/\babs\b/, 'comes out as VHDL text: compare and subtract' ],
    [ 'rem', qr/\brem\b/, 'comes out as the unsigned operator' ],
    [ 'shift_right', qr/\bshift_right\b/, 'of signed comes out as a logical shift: slice; waive it for unsigned' ],
    [ 'sra', qr/\b(sra|sla)\b/, 'use slices' ],
    [ 'std_match', qr/\bstd_match\b/, 'crashes the converter' ],
    [ 'vhdl2008', qr/\?=|\?\/=|\?<|\?>|\bprocess\s*\(\s*all\s*\)|\bcase\?|<<\s*signal/, 'not VHDL-93' ],
    [ 'initial_value', qr/\bsignal\b[^;]*:=/, 'initial values are not resets: reset the signal' ],
    [ 'not_hardware', qr/\bafter\b|\bwait\b|\bshared\s+variable\b/, 'no hardware' ],
    [ 'port_mode', qr/:\s*(buffer|inout)\b/, 'only in and out' ],
    [ 'generic_type', qr/\bg_\w+\s*:\s*(string|real|time)\b/, 'garbles netlist names: integer or boolean' ],
    [ 'library', qr/\bstd_logic_(arith|signed|unsigned)\b/, 'not a standard package: numeric_std' ],
    [ 'image', qr/'image\b/, "XST's parser may not take it: between translate_off and translate_on" ],
    [ 'unknown', qr/'x'/, 'no vendor has it in a template: between translate_off and translate_on' ],
    [ 'reserved', qr/\b(?:signal|variable|constant|entity|type|subtype|function|procedure|component)\s+($reserved)\b/,
        'a Verilog keyword' ],
    [ 'reserved', qr/(?:^|[;(])\s*($reserved)\s*:\s*(?:in|out)\b/, 'a Verilog keyword as port' ],
);

sub check_vhdl {
    my ($file) = @_;
    my $text = slurp($file);
    # Comments and strings go, line numbers stay.
    $text =~ s/"[^"\n]*"/""/g;
    $text =~ s/(--\s*synthesis\s+translate_off)(.*?)(--\s*synthesis\s+translate_on)/"\n" x ($2 =~ tr{\n}{})/gse;
    $text =~ s/--[^\n]*//g;
    my @lines = split /\n/, $text;
    for my $i (0 .. $#lines) {
        finding($file, $i + 1, 'camel_case', "$1: is lower-cased in the netlist", $lines[$i])
          if $lines[$i] =~ /\b([a-z]\w*[a-z][A-Z]\w*|[A-Z][a-z]\w*)\b/;
    }
    my $lower = lc $text;
    for my $rule (@vhdl_rules) {
        my ($name, $pattern, $why) = @$rule;
        while ($lower =~ /$pattern/g) {
            my $line = 1 + (substr($lower, 0, $-[0]) =~ tr/\n//);
            $line++ if substr($lower, $-[0], 1) eq "\n";
            finding($file, $line, $name, $why, $lines[ $line - 1 ]);
        }
    }
    my ($stem) = $file =~ m{([^/]*)\.vhd$};
    finding($file, 1, 'recursion', 'instantiates itself, which XST takes of components only')
      if $lower =~ /\bentity\s+work\.$stem\b/;
    my @entities = $lower =~ /^\s*entity\s+(\w+)\s+is\b/mg;
    finding($file, 1, 'one_entity', "entities: @entities, expected $stem")
      unless $stem =~ /_pkg$/ ? !@entities : "@entities" eq $stem;
}

# --- units ---
sub check_units {
    my ($file) = @_;
    my ($unit) = $file =~ m{([^/]*)\.vhd$};
    return if $unit =~ /_pkg$/;
    my %places = (golden => ["sw/golden/$unit.hpp"], page => ["docs/$unit.md"],
        test => [ map { "tb/$_/test_$unit.cpp" } qw(units engine chip) ]);
    for my $rule (sort keys %places) {
        finding($file, 1, $rule, "$places{$rule}[0] is missing") unless grep { -e } @{ $places{$rule} };
    }
}

# --- links ---
# Headings of a page as anchors: small letters, blanks to '-', other marks left out.
my %headings;
sub headings {
    my ($page) = @_;
    return $headings{$page} //= { map {
        my $name = lc;
        $name =~ s/[^a-z0-9 _-]//g;
        $name =~ s/ /-/g;
        $name => 1
    } slurp($page) =~ /^#+ (.*)$/mg };
}

sub check_links {
    my ($file) = @_;
    my ($folder) = $file =~ m{^(.*/)?[^/]*$};
    $folder //= '';
    my ($number, $code) = (0, 0);
    for my $line (split /\n/, slurp($file)) {
        $number++;
        $code = !$code if $line =~ /^```/;
        next if $code;
        while ($line =~ /\]\(([^)\s]+)\)|\bsrc="([^"]+)"/g) {
            my $target = $1 // $2;
            next if $target =~ m{^(https?:|mailto:)};
            my $anchor = $target =~ s/#(.*)// ? $1 : '';
            my $page = $target eq '' ? $file : "$folder$target";
            finding($file, $number, 'link', "$target does not exist", $line) unless -e $page;
            finding($file, $number, 'link', "no heading for #$anchor", $line)
              if $anchor ne '' && $page =~ /\.md$/ && -e $page && !headings($page)->{$anchor};
        }
    }
    # The index of the pages names all of them.
    return unless $file eq 'docs/README.md';
    my $index = slurp($file);
    for my $page (glob 'docs/*.md') {
        my ($name) = $page =~ m{([^/]+)$};
        finding($file, 1, 'index', "$name is not listed") if $name ne 'README.md' && index($index, "]($name)") < 0;
    }
}

die "lint_text: no files to check\n" unless @ARGV;
my %check = (text => \&check_text, vhdl => \&check_vhdl, units => \&check_units, links => \&check_links);
$check{$mode}->($_) for @ARGV;
for my $w (grep { $_->{mode} eq $mode && !$_->{used} } @waivers) {
    print "scripts/lint_waivers.txt:$w->{line}: unused: nothing there to waive\n";
    $found = 1;
}
exit $found;
