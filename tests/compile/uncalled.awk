# Which public functions of a header no chosen test calls, directly or through the functions of its file.
#   awk -f tests/compile/uncalled.awk HEADER PROGRAM.c CHOSEN      CHOSEN: a file whose lines begin with a test's name
FNR == 1 { file++ }

# Declarations: SSS_X_API type name(
file == 1 && /^SSS_[A-Z]+_API / {
    line = $0
    sub(/\(.*/, "", line)
    sub(/.*[ *]/, "", line)
    public[line] = 1
    next
}

# Functions begin with a brace in the first column and end with one; their name stands before the first parenthesis.
file == 2 && /^[a-z].*\(/ {
    name = $0
    sub(/\(.*/, "", name)
    sub(/.*[ *]/, "", name)
}
file == 2 && /^\{/ { inside = 1 }
file == 2 && /^\}/ { inside = 0 }
file == 2 && inside {
    line = $0
    sub(/\/\/.*/, "", line)
    while (match(line, /[A-Za-z_][A-Za-z_0-9]*/)) {
        word = substr(line, RSTART, RLENGTH)
        line = substr(line, RSTART + RLENGTH)
        if (!((name, word) in seen)) { seen[name, word] = 1; calls[name] = calls[name] " " word }
    }
}

file == 3 { queue[++last] = $1; reached[$1] = 1 }

END {
    for (i = 1; i <= last; ++i) {
        count = split(calls[queue[i]], words, " ")
        for (k = 1; k <= count; ++k)
            if (!(words[k] in reached)) { reached[words[k]] = 1; queue[++last] = words[k] }
    }
    for (name in public) { total++; if (!(name in reached)) print name }
    if (total < 5) print "no declarations found"
}
