-- outside LaTeX: a reference to the one figure in words
function RawInline(inline)
  if inline.format == "tex" and inline.text:match("^\\autoref") then
    return pandoc.Str("Figure 1")
  end
end
